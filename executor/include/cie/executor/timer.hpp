// A callback that time releases. Made by Node::create_wall_timer and create_one_shot_timer.
#pragma once

#include <cie/executor/callback_group.hpp>
#include <cie/executor/callback_handle.hpp>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

namespace cie {

namespace executor {
class TimerCallback;
}

struct TimerOptions {
  // As in CallbackOptions.
  std::shared_ptr<CallbackGroup> group{};
  std::string name{};
  std::chrono::nanoseconds deadline{0};
  // First expiry on CLOCK_MONOTONIC (steady_clock); if it is past when an executor first serves the
  // timer, the next instant of its grid. Absent: `phase` after an executor first serves it.
  std::optional<std::chrono::nanoseconds> start{};
  std::optional<std::chrono::nanoseconds> phase{};  // absent: one period
};

// Expiries of a periodic timer lie on an absolute grid and never drift. A timer that is served late
// runs once for the latest expiry, with the skipped ones counted. It ends with the last copy of its
// handle. The handle may outlive its node; it then is idle.
class Timer : public executor::CallbackHandle<executor::TimerCallback> {
 public:
  using CallbackHandle::CallbackHandle;

  // No instance is released any more; one that has begun ends. Thread-safe, also in the timer's own
  // callback; not for signal handlers.
  void cancel();
  // Begins anew: the next expiry is one period, or the delay, from now. Undoes cancel(), and lets a
  // one-shot timer expire once more. Before the timer is first served it only undoes cancel().
  void reset();
  // Whether cancel() was called, and reset() not since.
  bool is_cancelled() const;

  // Or the delay.
  std::chrono::nanoseconds period() const noexcept;
};

}  // namespace cie
