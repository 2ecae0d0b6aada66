// The expiries of rcl's timer, which rcl tells only as a remaining time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>

namespace cie_rclcpp {

struct TimerExpiry {
  std::int64_t expiry_ns = 0;
  std::uint32_t missed = 0;
};

// rcl moves a timer by whole periods: its expiries lie on a grid until somebody resets it, and the one
// after the latest waits until it is called for. Where a later one waits first, the timer was reset, be
// that instant on the grid or not: there a new grid begins. A measured expiry within 20 us of the grid
// (or a quarter of the period) is that instant of the grid, so that the error is that of the first
// measurement for ever.
class ExpiryGrid {
 public:
  explicit ExpiryGrid(std::int64_t period_ns) noexcept
      : period_ns_(std::max<std::int64_t>(period_ns, 1)) {}

  // From `now_ns` on somebody serves the timer; `next_ns`: its next expiry, or the first that is waiting.
  // Expiries before the last one until `now_ns` had nobody who could miss them.
  void begin(std::int64_t next_ns, std::int64_t now_ns) noexcept {
    const std::int64_t unserved = now_ns < next_ns ? 0 : (now_ns - next_ns) / period_ns_;
    anchor_ns_ = next_ns + (unserved - 1) * period_ns_;
  }

  // The timer was reset: the next expiry begins a new grid.
  void forget() noexcept { anchor_ns_.reset(); }

  // The instance that was just called for. As measured: `oldest_ns`, the first expiry that waited for
  // the call; `next_ns`, the one after it. Empty: these are no whole periods apart, and so a reset came
  // between the two.
  std::optional<TimerExpiry> on_call(std::int64_t oldest_ns, std::int64_t next_ns) noexcept {
    const std::int64_t tolerance = std::min<std::int64_t>(20'000, period_ns_ / 4);
    if (!anchor_ns_ || oldest_ns > *anchor_ns_ + period_ns_ + tolerance) {
      anchor_ns_ = oldest_ns - period_ns_;
    }
    const std::int64_t measured = next_ns - period_ns_;
    const std::int64_t periods = (measured - *anchor_ns_ + period_ns_ / 2) / period_ns_;
    const std::int64_t expiry = *anchor_ns_ + periods * period_ns_;
    if (periods < 1 || std::abs(measured - expiry) > tolerance) {
      forget();
      return std::nullopt;
    }
    anchor_ns_ = expiry;
    return TimerExpiry{.expiry_ns = expiry, .missed = limited(periods - 1)};
  }

 private:
  static std::uint32_t limited(std::int64_t missed) noexcept {
    constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::min(missed, kMost));
  }

  std::int64_t period_ns_;
  std::optional<std::int64_t> anchor_ns_;  // the latest expiry, or a period before the next
};

}  // namespace cie_rclcpp
