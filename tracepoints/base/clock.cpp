#include "clock.hpp"

#include <limits>

namespace cie {

ClockPair read_clocks() noexcept {
  ClockPair best{};
  std::int64_t shortest = std::numeric_limits<std::int64_t>::max();
  for (int attempt = 0; attempt < 5; ++attempt) {
    const std::int64_t before = now_ns(CLOCK_MONOTONIC);
    const std::int64_t realtime = now_ns(CLOCK_REALTIME);
    const std::int64_t interval = now_ns(CLOCK_MONOTONIC) - before;
    if (interval < shortest) {
      shortest = interval;
      best = {.monotonic_ns = before + interval / 2, .realtime_ns = realtime};
    }
  }
  return best;
}

}  // namespace cie
