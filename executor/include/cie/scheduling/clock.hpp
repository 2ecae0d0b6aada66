// CLOCK_MONOTONIC in integers, as the events carry it.
#pragma once

#include <cstdint>
#include <limits>

#include <time.h>

namespace cie::scheduling {

// "Never", as the time of the next expiry.
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

inline std::int64_t monotonic_now() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace cie::scheduling
