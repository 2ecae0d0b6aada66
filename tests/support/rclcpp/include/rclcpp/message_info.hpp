#pragma once

#include <rmw/types.h>

namespace rclcpp {

class MessageInfo {
 public:
  rmw_message_info_t& get_rmw_message_info() { return info_; }
  const rmw_message_info_t& get_rmw_message_info() const { return info_; }

 private:
  rmw_message_info_t info_{};
};

}  // namespace rclcpp
