#include "base/clock.hpp"

#include <cie/scheduling/clock.hpp>

namespace cie::scheduling {

std::int64_t monotonic_now() noexcept { return now_ns(CLOCK_MONOTONIC); }

}  // namespace cie::scheduling
