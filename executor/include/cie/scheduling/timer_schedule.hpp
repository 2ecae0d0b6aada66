// The arithmetic of a periodic timer, without a clock of its own.
#pragma once

#include <cie/scheduling/clock.hpp>

#include <atomic>
#include <cstdint>
#include <limits>
#include <optional>

namespace cie::scheduling {

// One release of a timer: the scheduled expiry and the whole periods skipped before it.
struct TimerRelease {
  std::int64_t expiry_ns = 0;
  std::uint32_t missed = 0;
};

// Expiries lie on the grid first + k * period for ever: E(k+1) = E(k) + (1 + missed(k+1)) * period.
// take() is lock-free, so that the threads of a reentrant group may share a timer, and another may
// start it anew meanwhile: a new grid then, which counts no missed expiry of the old one.
class TimerSchedule {
 public:
  // `period_ns` > 0.
  explicit TimerSchedule(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

  // Sets the first expiry; kNever: none. One thread at a time.
  void start_at(std::int64_t first_ns) noexcept {
    next_ns_.store(first_ns, std::memory_order_relaxed);
  }
  // The first expiry is `anchor_ns`, or if that is past, the next instant of its grid.
  void start_on_grid(std::int64_t anchor_ns, std::int64_t now_ns) noexcept {
    if (anchor_ns < now_ns) {
      const auto steps = (now_ns - anchor_ns - 1) / period_ns_ + 1;
      anchor_ns = expiry_after(anchor_ns, steps);
    }
    start_at(anchor_ns);
  }

  std::int64_t period_ns() const noexcept { return period_ns_; }
  // kNever before start_at().
  std::int64_t next_due() const noexcept { return next_ns_.load(std::memory_order_relaxed); }

  // The latest expiry that is due at `now_ns`, or nothing. Each is given out once.
  std::optional<TimerRelease> take(std::int64_t now_ns) noexcept {
    std::int64_t next = next_due();
    std::int64_t skipped = 0;
    do {
      if (now_ns < next) return std::nullopt;
      skipped = (now_ns - next) / period_ns_;
    } while (!next_ns_.compare_exchange_weak(next, expiry_after(next, skipped + 1),
                                             std::memory_order_relaxed));
    constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
    return TimerRelease{.expiry_ns = next + skipped * period_ns_,
                        .missed = static_cast<std::uint32_t>(skipped < kMost ? skipped : kMost)};
  }

  // The expiry, if it is due; none follows it. For a timer that expires once.
  std::optional<TimerRelease> take_last(std::int64_t now_ns) noexcept {
    std::int64_t next = next_due();
    do {
      if (now_ns < next) return std::nullopt;
    } while (!next_ns_.compare_exchange_weak(next, kNever, std::memory_order_relaxed));
    return TimerRelease{.expiry_ns = next, .missed = 0};
  }

 private:
  std::int64_t expiry_after(std::int64_t expiry_ns, std::int64_t steps) const noexcept {
    std::int64_t until = 0;
    return __builtin_mul_overflow(steps, period_ns_, &until) ? kNever : later(expiry_ns, until);
  }

  std::int64_t period_ns_;
  std::atomic<std::int64_t> next_ns_{kNever};
};

}  // namespace cie::scheduling
