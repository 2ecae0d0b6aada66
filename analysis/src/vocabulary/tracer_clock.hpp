// What every reader makes of a tracer's clock.
#pragma once

#include <cie/analysis/time.hpp>

#include <cstdint>

namespace cie::analysis {

// Cycles of a clock as nanoseconds, without its offset. LTTng's count nanoseconds already.
constexpr Timestamp time_of_cycles(std::uint64_t cycles, std::uint64_t frequency) noexcept {
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  if (frequency == kNanoseconds) return {static_cast<std::int64_t>(cycles)};
  __extension__ using Wide = unsigned __int128;
  return {static_cast<std::int64_t>(
      static_cast<std::uint64_t>(static_cast<Wide>(cycles) * kNanoseconds / frequency))};
}

// Between a clock's origin and that of the wall clock, in nanoseconds; metadata has it in two parts.
constexpr std::int64_t clock_offset(std::int64_t seconds, std::uint64_t cycles,
                                    std::uint64_t frequency) noexcept {
  const auto whole = static_cast<std::uint64_t>(seconds) * 1'000'000'000U;
  return detail::wrapping_add(static_cast<std::int64_t>(whole),
                              time_of_cycles(cycles, frequency).ns);
}

}  // namespace cie::analysis
