// Points in time and differences of them, in whole nanoseconds. Values come from untrusted traces,
// so arithmetic wraps instead of being undefined; sums are kept wider (see statistics.hpp).
#pragma once

#include <compare>
#include <cstdint>
#include <limits>

namespace cie::analysis {

struct Duration {
  std::int64_t ns = 0;
  // clang-tidy 14 sees a null pointer in the comparison with 0 that the compiler writes here.
  // NOLINTNEXTLINE(modernize-use-nullptr)
  friend constexpr auto operator<=>(const Duration&, const Duration&) = default;
};

// Unsigned nanoseconds as signed ones: what is beyond them, 292 years and more, is their most.
constexpr std::int64_t signed_ns(std::uint64_t ns) noexcept {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  return static_cast<std::int64_t>(ns < kMost ? ns : kMost);
}

// A point on a host's CLOCK_MONOTONIC.
struct Timestamp {
  std::int64_t ns = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr)
  friend constexpr auto operator<=>(const Timestamp&, const Timestamp&) = default;
};

namespace detail {
constexpr std::int64_t wrapping_add(std::int64_t a, std::int64_t b) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
constexpr std::int64_t wrapping_sub(std::int64_t a, std::int64_t b) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
// Whether two offsets between CLOCK_MONOTONIC and CLOCK_REALTIME, in nanoseconds, may be of one
// machine: tracers measure no better than that.
constexpr bool are_alike(std::int64_t offset, std::int64_t other) noexcept {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto difference = wrapping_sub(offset, other);
  return difference > -kSecond && difference < kSecond;
}
}  // namespace detail

constexpr Duration operator-(Timestamp a, Timestamp b) noexcept {
  return {detail::wrapping_sub(a.ns, b.ns)};
}
constexpr Timestamp operator+(Timestamp t, Duration d) noexcept {
  return {detail::wrapping_add(t.ns, d.ns)};
}
constexpr Timestamp operator-(Timestamp t, Duration d) noexcept {
  return {detail::wrapping_sub(t.ns, d.ns)};
}
constexpr Duration operator+(Duration a, Duration b) noexcept {
  return {detail::wrapping_add(a.ns, b.ns)};
}
constexpr Duration operator-(Duration a, Duration b) noexcept {
  return {detail::wrapping_sub(a.ns, b.ns)};
}
constexpr Duration& operator+=(Duration& a, Duration b) noexcept { return a = a + b; }

// The ends of time, for bounds of what has none. Whether there is a time at all is told by an optional.
inline constexpr Timestamp kEarliest{std::numeric_limits<std::int64_t>::min()};
inline constexpr Timestamp kLatest{std::numeric_limits<std::int64_t>::max()};
// Where every clock begins: the begin of what began nobody knows when.
inline constexpr Timestamp kBoot{};

// A part of a recording, its ends included, in nanoseconds of CLOCK_MONOTONIC.
struct TimeWindow {
  Timestamp from = kEarliest;
  Timestamp to = kLatest;
  friend bool operator==(const TimeWindow&, const TimeWindow&) = default;
};

}  // namespace cie::analysis
