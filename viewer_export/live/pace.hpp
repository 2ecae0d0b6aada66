// When a running system is looked at next.
#pragma once

#include <algorithm>
#include <chrono>

namespace cie::live {

// Once per interval, and more rarely where looking costs much. Only what looking itself costs
// counts, not for how long a reader of the lines, or whoever stopped the process, held it up.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;
  using Duration = Clock::duration;

  // Looking may take one part in so many of the time,
  static constexpr int kParts = 10;
  // but what runs is looked at as often as this, or once per interval.
  static constexpr std::chrono::seconds kLongestStretch{30};

  Pace(Duration interval, Clock::time_point begun) : interval_(interval), next_(begun + interval) {}

  bool is_due(Clock::time_point now) const noexcept { return now >= next_; }
  // A look ended that cost so much CPU time.
  void looked(Clock::time_point now, Duration cost) noexcept {
    const auto longest = std::max<Duration>(kLongestStretch, interval_);
    next_ = std::max(next_ + interval_, now + std::min(kParts * cost, longest));
  }
  // What was seen last is doubted: the next look is due.
  void hasten(Clock::time_point now) noexcept { next_ = std::min(next_, now); }

 private:
  Duration interval_;
  Clock::time_point next_;
};

}  // namespace cie::live
