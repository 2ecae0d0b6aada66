// The last events of one CPU, in memory.
#pragma once

#include "kernel/ctf_stream.hpp"
#include "kernel/kernel_source.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

namespace cie::record {

class KernelRing final : public KernelEventSink {
 public:
  // Keeps what is younger than `length`, and no more than about `most_bytes`. `begin`: from when on
  // nothing was missed.
  KernelRing(std::chrono::nanoseconds length, std::size_t most_bytes, std::uint64_t begin);

  void on_event(std::uint64_t time, std::string_view event) override;
  void on_loss(std::uint64_t time, std::uint64_t total) override;

  // From when on all that came is here, or is told to be lost. ns, CLOCK_MONOTONIC
  std::uint64_t begin() const noexcept { return begin_; }
  // Hands all of it over, as it came; losses are counted from the begin.
  void replay(KernelEventSink& sink) const;
  // Of `total` events that were lost so far, those since the begin.
  std::uint64_t lost_since_begin(std::uint64_t total) const noexcept;

 private:
  struct Block {
    std::uint64_t lost = 0;       // so far, before its first event
    std::uint64_t loss_time = 0;  // 0: none right before it
    std::uint64_t end = 0;        // time of its last event
    std::string events;
  };

  void trim(std::uint64_t now);

  std::chrono::nanoseconds length_;
  std::size_t most_bytes_;
  std::uint64_t begin_;
  std::uint64_t lost_before_ = 0;  // the begin
  std::deque<Block> blocks_{1};    // never empty
  std::size_t bytes_ = 0;
};

}  // namespace cie::record
