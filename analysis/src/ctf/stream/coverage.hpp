// What streams cover of the time line, known from their packets' headers before anything is read.
#pragma once

#include <cie/analysis/time.hpp>

#include "stream_reader.hpp"

#include <optional>
#include <span>
#include <vector>

namespace cie::analysis::ctf {

// A stream from the headers of its packets. `files` in order of time, at least one; borrowed.
class PacketTimes {
 public:
  explicit PacketTimes(std::span<const StreamFile> files) : files_(files) {}

  // Stops at the first packet that has an event.
  bool has_events() const;
  // Empty if packets have no times. Stops at the first packet that ends at `enough` or later.
  std::optional<TimeWindow> times(Timestamp enough) const;

 private:
  std::span<const StreamFile> files_;
};

// Which streams of a channel have no time in common with most others: without them, the rest has.
struct LeftOut {
  std::vector<bool> streams;  // by their place in the argument; all false: none
  TimeWindow common{};        // of the rest
};

// The fewest are left out; of several ways the one with the longest common time, then the earliest.
LeftOut left_out(std::span<const TimeWindow> streams);

}  // namespace cie::analysis::ctf
