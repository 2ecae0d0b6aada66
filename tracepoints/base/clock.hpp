// The machine's clocks, in nanoseconds.
#pragma once

#include <cstdint>
#include <ctime>

namespace cie {

inline std::int64_t now_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// One instant on the two clocks of the contract.
struct ClockPair {
  std::int64_t monotonic_ns;
  std::int64_t realtime_ns;
};

// Reads both clocks a few times and returns the pair taken in the shortest interval; its error is
// at most half of that interval, usually some tens of nanoseconds.
ClockPair read_clocks() noexcept;

}  // namespace cie
