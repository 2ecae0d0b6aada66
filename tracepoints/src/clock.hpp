// The two clocks of the contract.
#pragma once

#include <cstdint>

namespace cie::trace {

std::int64_t monotonic_now_ns() noexcept;

// One instant on both clocks.
struct ClockPair {
  std::int64_t monotonic_ns;
  std::int64_t realtime_ns;
};

// Reads both clocks a few times and returns the pair taken in the shortest interval; its error is
// at most half of that interval, usually some tens of nanoseconds.
ClockPair read_clocks() noexcept;

}  // namespace cie::trace
