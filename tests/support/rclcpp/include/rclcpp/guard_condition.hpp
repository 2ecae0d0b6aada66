#pragma once

#include <cstddef>
#include <functional>
#include <mutex>

#include <rclcpp/context.hpp>

namespace rclcpp {

class GuardCondition {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(GuardCondition)
  explicit GuardCondition(
      const Context::SharedPtr& context = contexts::get_global_default_context());
  Context::SharedPtr get_context() const { return context_; }
  void trigger();
  // Told at once how often it was triggered before.
  void set_on_trigger_callback(std::function<void(std::size_t)> callback);

 private:
  const Context::SharedPtr context_;
  std::recursive_mutex mutex_;
  std::function<void(std::size_t)> on_trigger_;
  std::size_t unread_ = 0;
};

}  // namespace rclcpp
