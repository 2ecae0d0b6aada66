// CLOCK_MONOTONIC in integers, as the events carry it.
#pragma once

#include <cstdint>
#include <limits>

namespace cie::scheduling {

// "Never", as the time of the next expiry.
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

std::int64_t monotonic_now() noexcept;

}  // namespace cie::scheduling
