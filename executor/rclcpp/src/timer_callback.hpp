// A timer of rclcpp as a callback that an executor of cie runs.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "entity_callback.hpp"
#include "expiry_grid.hpp"
#include "inbox.hpp"

#include <atomic>
#include <cstdint>
#include <memory>

#include <rclcpp/clock.hpp>
#include <rclcpp/timer.hpp>

namespace cie_rclcpp {

// Nanoseconds; 0 for a timer that is always due.
std::int64_t period_of(const rcl_timer_t& timer);

// Releases are the expiries of a steady timer, exactly. Those of a timer on ROS or system time are
// not known on CLOCK_MONOTONIC, and a timer that is always due has none: these are not said.
class TimerCallback final : public cie::scheduling::Callback, public Admitted {
 public:
  TimerCallback(std::shared_ptr<cie::scheduling::GroupState> group, cie::trace::CallbackInfo info,
                const rclcpp::TimerBase::SharedPtr& timer, std::shared_ptr<Admission> admission,
                OnGone on_gone);
  ~TimerCallback() override { end(); }

  std::int64_t next_due() const noexcept override { return is_admitted() ? ready_at() : kNever; }
  void serve(cie::scheduling::ReadySink* sink) override;
  bool has_queue() const noexcept override { return false; }
  bool has_timer() const noexcept override { return true; }
  std::uint64_t waiting() const noexcept override { return time_until_next_call() <= 0 ? 1 : 0; }
  // Of a timer that was cancelled: a period from now, where its reset() would not tell us.
  std::int64_t ready_at() const noexcept override;
  void wake() noexcept override { inbox_->wake(); }

 private:
  static constexpr std::int64_t kNever = cie::scheduling::kNever;

  bool run_one() override;
  void on_failure_handled() noexcept override { leave_after_failure(); }
  void dispose() noexcept override;
  // kNever: it was cancelled, or has gone.
  std::int64_t time_until_next_call() const noexcept;
  std::int64_t measured_next() const noexcept;
  void begin_grid();
  // `oldest_ns`: the first expiry that waited for the call.
  cie::trace::Callback::Release release(std::int64_t oldest_ns) noexcept;

  const std::weak_ptr<rclcpp::TimerBase> timer_;
  const std::weak_ptr<const rcl_timer_t> handle_;
  const std::int64_t period_ns_;
  const OnGone on_gone_;
  const bool is_steady_;
  const bool has_expiries_;             // on CLOCK_MONOTONIC
  const std::shared_ptr<Inbox> inbox_;  // for its target alone
  const std::shared_ptr<std::atomic<bool>> was_reset_ = std::make_shared<std::atomic<bool>>(false);
  bool tells_reset_ = false;
  rclcpp::JumpHandler::SharedPtr jumps_;
  cie::PriorityMutex mutex_;  // of what follows, and of taking an expiry
  bool is_begun_ = false;     // to be served
  ExpiryGrid grid_;
};

}  // namespace cie_rclcpp
