#pragma once

#include <stdexcept>
#include <string>

#include <rcl/error_handling.h>
#include <rcl/types.h>

namespace rclcpp::exceptions {

struct RCLError : std::runtime_error {
  explicit RCLError(rcl_ret_t result)
      : std::runtime_error{"rcl says " + std::to_string(result)}, ret(result) {}
  rcl_ret_t ret;
};
[[noreturn]] inline void throw_from_rcl_error(rcl_ret_t result) { throw RCLError{result}; }

}  // namespace rclcpp::exceptions
