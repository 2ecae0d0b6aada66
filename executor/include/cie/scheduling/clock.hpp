// CLOCK_MONOTONIC in integers, as the events carry it.
#pragma once

#include <cstdint>
#include <limits>

namespace cie::scheduling {

// "Never", as the time of the next expiry.
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

std::int64_t monotonic_now() noexcept;

// The time so long after the other one: kNever if that is beyond what the clock counts, its beginning
// if that is before it.
constexpr std::int64_t later(std::int64_t from_ns, std::int64_t duration_ns) noexcept {
  std::int64_t time = 0;
  if (__builtin_add_overflow(from_ns, duration_ns, &time)) return duration_ns > 0 ? kNever : 0;
  return time < 0 ? 0 : time;
}

}  // namespace cie::scheduling
