// Durations as people write them, for the scheduling spec and for options of commands.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace cie {

// The number of decimal digits alone, no sign; empty for anything else and beyond 63 bits.
std::optional<std::int64_t> parse_digits(std::string_view text) noexcept;

// Nanoseconds of "250ns", "200us", "1.5ms", "1s" and "2min": decimal digits, perhaps with a
// fraction, and a unit. Exact: empty for what is no whole number of nanoseconds or too many for 63
// bits, and for anything else.
std::optional<std::int64_t> parse_duration(std::string_view text) noexcept;

}  // namespace cie
