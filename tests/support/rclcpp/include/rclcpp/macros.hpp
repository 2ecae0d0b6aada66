#pragma once

#include <memory>
#include <utility>

#define RCLCPP_SMART_PTR_DEFINITIONS(Class)                      \
  using SharedPtr = std::shared_ptr<Class>;                      \
  using ConstSharedPtr = std::shared_ptr<const Class>;           \
  using WeakPtr = std::weak_ptr<Class>;                          \
  using UniquePtr = std::unique_ptr<Class>;                      \
  template <typename... Args>                                    \
  static std::shared_ptr<Class> make_shared(Args&&... args) {    \
    return std::make_shared<Class>(std::forward<Args>(args)...); \
  }
