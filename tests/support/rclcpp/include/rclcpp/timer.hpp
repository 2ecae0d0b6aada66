#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>

#include <rcl/error_handling.h>
#include <rcl/timer.h>
#include <rclcpp/clock.hpp>
#include <rclcpp/version.h>

namespace rclcpp {

class TimerBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(TimerBase)
  TimerBase(Clock::SharedPtr clock, std::chrono::nanoseconds period);
  TimerBase(const TimerBase&) = delete;
  TimerBase& operator=(const TimerBase&) = delete;
  virtual ~TimerBase() { clear_on_reset_callback(); }

  void cancel() { rcl_timer_cancel(timer_handle_.get()); }
  void reset() { rcl_timer_reset(timer_handle_.get()); }
  bool is_canceled() const { return timer_handle_->canceled.load(); }
  std::chrono::nanoseconds time_until_trigger() const;
  std::shared_ptr<const rcl_timer_t> get_timer_handle() { return timer_handle_; }
#if RCLCPP_VERSION_MAJOR < 28
  virtual bool call() = 0;
  virtual void execute_callback() = 0;
#else
  virtual std::shared_ptr<void> call() = 0;
  virtual void execute_callback(const std::shared_ptr<void>& data) = 0;
  void set_on_reset_callback(const std::function<void(std::size_t)>& callback);
#endif
  void clear_on_reset_callback();
  virtual bool is_steady() = 0;

 protected:
  std::recursive_mutex on_reset_mutex_;
  std::function<void(std::size_t)> on_reset_;  // rcl knows it by its address alone
  Clock::SharedPtr clock_;
  std::shared_ptr<rcl_timer_t> timer_handle_;

 private:
  JumpHandler::SharedPtr jumps_;
};

template <typename Function>
class GenericTimer : public TimerBase {
 public:
  GenericTimer(Clock::SharedPtr clock, std::chrono::nanoseconds period, Function function)
      : TimerBase(std::move(clock), period), function_(std::move(function)) {}
#if RCLCPP_VERSION_MAJOR < 28
  bool call() override { return rcl_timer_call(timer_handle_.get()) == RCL_RET_OK; }
  void execute_callback() override { run(); }
#else
  std::shared_ptr<void> call() override {
    return rcl_timer_call(timer_handle_.get()) == RCL_RET_OK ? std::make_shared<int>() : nullptr;
  }
  void execute_callback(const std::shared_ptr<void>&) override { run(); }
#endif
  bool is_steady() override { return clock_->get_clock_handle()->type == RCL_STEADY_TIME; }

 private:
  void run() {
    if constexpr (std::is_invocable_v<Function, TimerBase&>) {
      function_(*this);
    } else {
      function_();
    }
  }
  Function function_;
};

}  // namespace rclcpp
