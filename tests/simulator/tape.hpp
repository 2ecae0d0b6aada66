// What a simulation writes: its events in the order in which they happen, and a recording made of
// them, with streams, packets and edges as a tracer would have.
#pragma once

#include <cie/analysis/event.hpp>

#include "support/trace_text.hpp"
#include "system.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cie::sim {

// What a recording covers of a simulation. Each edge is of one processor's stream.
struct Recording {
  bool has_kernel = true;
  bool has_wakings = true;       // sched_waking, or sched_wakeup only
  bool is_by_process = false;    // a channel of its own for each process
  std::vector<Ns> user_begin{};  // by processor; empty: everything
  std::vector<Ns> user_end{};
  Ns kernel_begin = 0;  // 0: everything; before the events it needs
  Ns kernel_end = 0;
  std::uint64_t order = 0;  // of the streams, which decides between events of equal time
};

// Of the kernel's tracer.
bool is_kernel(const analysis::Event& event);

class Tape {
 public:
  explicit Tape(int cpus);

  std::string_view keep(std::string text) { return strings_->emplace_back(std::move(text)); }
  std::span<const std::uint32_t> keep(std::vector<std::uint32_t> cpus) {
    return cpus_->emplace_back(std::move(cpus));
  }
  void user(Ns time, std::int32_t cpu, std::int64_t pid, std::int64_t tid,
            const analysis::EventBody& body);
  void kernel(Ns time, std::int32_t cpu, const analysis::EventBody& body);

  Ns end() const { return events_.empty() ? 0 : events_.back().head.time.ns; }
  test::TextTrace trace(const Recording& recording) const;

 private:
  std::int32_t processors_;
  std::vector<analysis::Event> events_;
  std::shared_ptr<std::deque<std::string>> strings_;
  std::shared_ptr<std::deque<std::vector<std::uint32_t>>> cpus_;
};

constexpr Ns kRealtimeOffset = 1'700'000'000'000'000'000;  // CLOCK_REALTIME - CLOCK_MONOTONIC
constexpr Ns kBeginning = 1'000'000'000;                   // of a simulation, CLOCK_MONOTONIC

}  // namespace cie::sim
