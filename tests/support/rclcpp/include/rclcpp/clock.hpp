#pragma once

#include <chrono>
#include <functional>

#include <rcl/time.h>
#include <rclcpp/macros.hpp>

namespace rclcpp {

class Duration {
 public:
  explicit Duration(std::chrono::nanoseconds duration) : duration_(duration) {}
  std::int64_t nanoseconds() const { return duration_.count(); }

 private:
  std::chrono::nanoseconds duration_;
};

class JumpHandler {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(JumpHandler)
  JumpHandler(std::shared_ptr<rcl_clock_t> clock, JumpListener listener)
      : clock_(std::move(clock)), number_(add_jump_listener(*clock_, std::move(listener))) {}
  JumpHandler(const JumpHandler&) = delete;
  JumpHandler& operator=(const JumpHandler&) = delete;
  ~JumpHandler() { remove_jump_listener(*clock_, number_); }

 private:
  const std::shared_ptr<rcl_clock_t> clock_;
  const int number_;
};

class Clock {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Clock)
  explicit Clock(rcl_clock_type_t type = RCL_SYSTEM_TIME)
      : clock_(std::make_shared<rcl_clock_t>()) {
    clock_->type = type;
  }
  rcl_clock_t* get_clock_handle() { return clock_.get(); }
  const std::shared_ptr<rcl_clock_t>& shared() const { return clock_; }
  JumpHandler::SharedPtr create_jump_callback(std::function<void()> before,
                                              std::function<void(const rcl_time_jump_t&)> after,
                                              const rcl_jump_threshold_t& threshold);

 private:
  std::shared_ptr<rcl_clock_t> clock_;
};

}  // namespace rclcpp
