// What an entity has the middleware call when something new is there.
#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <stdexcept>

#include <rmw_double/bus.hpp>

namespace rclcpp {

// The middleware knows the function by its address alone, as in rclcpp: it is not told when that goes.
class OnNewCallback {
 public:
  void set(rmw_double::Reader& reader, const std::function<void(std::size_t)>& callback) {
    if (!callback) throw std::invalid_argument{"The callback passed is not callable."};
    const std::function<void(std::size_t)> fresh = [callback](std::size_t count) {
      callback(count);
    };
    const std::lock_guard lock{mutex_};
    reader.set_on_new(&OnNewCallback::call, &fresh);  // no gap while it takes its place
    function_ = fresh;
    reader.set_on_new(&OnNewCallback::call, &function_);
  }
  void clear(rmw_double::Reader& reader) {
    const std::lock_guard lock{mutex_};
    if (!function_) return;
    reader.set_on_new(nullptr, nullptr);
    function_ = nullptr;
  }
  bool is_set() {
    const std::lock_guard lock{mutex_};
    return static_cast<bool>(function_);
  }

 private:
  static void call(const void* function, std::size_t count) {
    (*static_cast<const std::function<void(std::size_t)>*>(function))(count);
  }

  std::recursive_mutex mutex_;
  std::function<void(std::size_t)> function_;
};

}  // namespace rclcpp
