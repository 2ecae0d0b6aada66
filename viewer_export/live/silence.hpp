// For how long nothing was heard of another process.
#pragma once

#include <algorithm>
#include <chrono>

namespace cie::live {

// Only time in which one listened counts: who was stopped, or waited for the reader of their own
// output, knows nothing of the other.
class Silence {
 public:
  using Clock = std::chrono::steady_clock;
  using Duration = Clock::duration;

  // Of what passes between two calls of listen() no more than this counts.
  static constexpr std::chrono::milliseconds kLongestStep{500};

  explicit Silence(Clock::time_point now) : last_(now) {}

  void listen(Clock::time_point now) noexcept {
    if (!is_excused_) duration_ += std::min<Duration>(now - last_, kLongestStep);
    last_ = now;
  }
  // `is_excused`: the other one said that it is busy, and is not expected to say anything for now.
  void heard(bool is_excused) noexcept {
    is_excused_ = is_excused;
    duration_ = {};
  }
  Duration duration() const noexcept { return duration_; }

 private:
  Clock::time_point last_;
  Duration duration_{};
  bool is_excused_ = false;
};

}  // namespace cie::live
