#include "timer_callback.hpp"

#include <cie/scheduling/clock.hpp>

#include "distributions.hpp"

#include <algorithm>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include <rcl/error_handling.h>
#include <rcl/time.h>
#include <rcl/timer.h>

namespace cie_rclcpp {
namespace {

using cie::ReleaseKind;
using cie::scheduling::monotonic_now;

// A timer's clock is a protected member of its base.
class ClockOf : public rclcpp::TimerBase {
 public:
  static rclcpp::Clock::SharedPtr get(const rclcpp::TimerBase& timer) {
    return timer.*(&ClockOf::clock_);
  }
};

// Whether time is what somebody publishes on /clock.
bool is_simulated(const rcl_timer_t& timer) noexcept {
  rcl_clock_t* clock = nullptr;
  bool is_enabled = false;
  if (rcl_timer_clock(const_cast<rcl_timer_t*>(&timer), &clock) != RCL_RET_OK ||
      clock->type != RCL_ROS_TIME ||
      rcl_is_enabled_ros_time_override(clock, &is_enabled) != RCL_RET_OK) {
    return false;
  }
  return is_enabled;
}

}  // namespace

std::int64_t period_of(const rcl_timer_t& timer) {
  std::int64_t period = 0;
  if (rcl_timer_get_period(&timer, &period) != RCL_RET_OK) rcl_reset_error();
  return period;
}

TimerCallback::TimerCallback(std::shared_ptr<cie::scheduling::GroupState> group,
                             cie::trace::CallbackInfo info,
                             const rclcpp::TimerBase::SharedPtr& timer,
                             std::shared_ptr<Admission> admission, OnGone on_gone)
    : Callback(std::move(group), std::move(info)),
      Admitted(std::move(admission)),
      timer_(timer),
      handle_(timer->get_timer_handle()),
      period_ns_(std::max<std::int64_t>(period_of(*timer->get_timer_handle()), 1)),
      on_gone_(std::move(on_gone)),
      is_steady_(timer->is_steady()),
      has_expiries_(is_steady_ && period_of(*timer->get_timer_handle()) > 0),
      inbox_(std::make_shared<Inbox>(1, 0)),
      grid_(period_ns_) {
  tells_reset_ = tell_of_reset(
      *timer, [inbox = inbox_, was_reset = was_reset_, gone = farewell(on_gone_)](std::size_t) {
        was_reset->store(true);
        inbox->wake();
      });
  if (is_steady_) return;
  rcl_jump_threshold_t any_step{};
  any_step.on_clock_change = true;
  any_step.min_forward.nanoseconds = 1;
  any_step.min_backward.nanoseconds = -1;
  jumps_ = ClockOf::get(*timer)->create_jump_callback(
      nullptr, [inbox = inbox_](const rcl_time_jump_t&) { inbox->wake(); }, any_step);
}

std::int64_t TimerCallback::time_until_next_call() const noexcept {
  bool is_cancelled = false;
  std::int64_t until = 0;
  const auto timer = handle_.lock();
  if (!timer) return kNever;
  if (rcl_timer_is_canceled(timer.get(), &is_cancelled) != RCL_RET_OK || is_cancelled ||
      rcl_timer_get_time_until_next_call(timer.get(), &until) != RCL_RET_OK) {
    rcl_reset_error();
    return kNever;
  }
  return until;
}

std::int64_t TimerCallback::ready_at() const noexcept {
  const auto timer = handle_.lock();
  if (!timer) {
    on_gone_();
    return kNever;
  }
  const std::int64_t until = time_until_next_call();
  if (until == kNever) {
    return tells_reset_ ? kNever : monotonic_now() + period_ns_;
  }
  if (until > 0 && !is_steady_ && is_simulated(*timer)) {
    return kNever;  // a step of that clock tells
  }
  // Read after rcl read it, so that the thread does not wake too early by what lies between.
  const std::int64_t now = monotonic_now();
  return until < kNever - now ? now + until : kNever;
}

// rcl reads the clock between two readings of ours: the closest pair of a few says it best.
std::int64_t TimerCallback::measured_next() const noexcept {
  std::int64_t next = 0;
  std::int64_t narrowest = std::numeric_limits<std::int64_t>::max();
  for (int attempt = 0; attempt < 8 && narrowest > 200; ++attempt) {
    const std::int64_t before = monotonic_now();
    const std::int64_t until = time_until_next_call();
    const std::int64_t after = monotonic_now();
    if (until == kNever || after - before >= narrowest) continue;
    narrowest = after - before;
    next = before + (after - before) / 2 + until;
  }
  return next;
}

// As cie's own timers: a later serving keeps the grid, and what fell between was missed.
void TimerCallback::begin_grid() {
  const std::lock_guard lock{mutex_};
  if (is_begun_) return;
  was_reset_->store(false);  // by whom ever: the grid begins now
  const std::int64_t next = measured_next();
  if (next == 0) return;
  grid_.begin(next, monotonic_now());
  is_begun_ = true;
}

void TimerCallback::serve(cie::scheduling::ReadySink* sink) {
  if (sink != nullptr && has_expiries_) begin_grid();
  inbox_->set_target(sink, this);
}

// Not known where the timer was cancelled or reset while it was called, nor while it has another period
// than it was announced with: its expiries then lie on no grid of that.
cie::trace::Callback::Release TimerCallback::release(std::int64_t oldest_ns) noexcept {
  if (!has_expiries_) return {.kind = ReleaseKind::timer};
  const auto timer = handle_.lock();
  if (!timer || period_of(*timer) != period_ns_) {
    grid_.forget();
    return {.kind = ReleaseKind::timer};
  }
  const std::int64_t called = monotonic_now();
  const std::int64_t next = measured_next();
  if (next == 0 || next - period_ns_ > called) return {.kind = ReleaseKind::timer};
  if (was_reset_->exchange(false)) grid_.forget();
  const auto expiry = grid_.on_call(oldest_ns, next);
  if (!expiry) return {.kind = ReleaseKind::timer};
  return {.kind = ReleaseKind::timer, .release_ns = expiry->expiry_ns, .missed = expiry->missed};
}

bool TimerCallback::run_one() {
  const auto timer = timer_.lock();
  if (!timer) return false;
  Admission::Entry entry = enter();
  if (!entry) return false;
  std::optional<Instance> instance;
  std::unique_lock lock{mutex_};
  if (time_until_next_call() > 0) return false;
  const std::int64_t oldest = has_expiries_ ? measured_next() : 0;
  return call_timer(*timer, [&] {
    const auto released = release(oldest);
    lock.unlock();
    instance.emplace(*this, released);
    entry.begin();
  });
}

void TimerCallback::dispose() noexcept {
  leave_share();
  inbox_->set_target(nullptr, nullptr);
  jumps_.reset();
  if (const auto timer = timer_.lock()) end_telling_of_reset(*timer);
}

}  // namespace cie_rclcpp
