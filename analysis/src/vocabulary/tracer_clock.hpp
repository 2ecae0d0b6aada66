// What every reader makes of a tracer's clock.
#pragma once

#include <cie/analysis/time.hpp>

#include <cstdint>
#include <limits>

namespace cie::analysis {

inline constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

// Cycles of a clock as nanoseconds, without its offset; kLatest if they are beyond that. LTTng's count
// nanoseconds already.
constexpr Timestamp time_of_cycles(std::uint64_t cycles, std::uint64_t frequency) noexcept {
  if (frequency == kNanosecondsPerSecond) return {signed_ns(cycles)};
  __extension__ using Wide = unsigned __int128;
  const auto ns = static_cast<Wide>(cycles) * kNanosecondsPerSecond / frequency;
  if (ns >= static_cast<Wide>(kLatest.ns)) return kLatest;
  return {static_cast<std::int64_t>(ns)};
}

// The last cycles of a clock that are before kLatest.
constexpr std::uint64_t most_cycles(std::uint64_t frequency) noexcept {
  __extension__ using Wide = unsigned __int128;
  const auto beyond = (static_cast<Wide>(kLatest.ns) * frequency + kNanosecondsPerSecond - 1) /
                      kNanosecondsPerSecond;
  constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
  return beyond > kMost ? kMost : static_cast<std::uint64_t>(beyond) - 1;
}

// Between a clock's origin and that of the wall clock, in nanoseconds; metadata has it in two parts.
constexpr std::int64_t clock_offset(std::int64_t seconds, std::uint64_t cycles,
                                    std::uint64_t frequency) noexcept {
  __extension__ using Wide = unsigned __int128;
  const auto whole = static_cast<std::uint64_t>(seconds) * kNanosecondsPerSecond;
  const auto rest = static_cast<Wide>(cycles) * kNanosecondsPerSecond / frequency;
  return static_cast<std::int64_t>(whole + static_cast<std::uint64_t>(rest));
}

}  // namespace cie::analysis
