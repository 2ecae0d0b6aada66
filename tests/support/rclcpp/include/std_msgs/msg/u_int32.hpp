#pragma once

#include <cstdint>
#include <memory>

namespace std_msgs::msg {
struct UInt32 {
  using SharedPtr = std::shared_ptr<UInt32>;
  std::uint32_t data = 0;
};
}  // namespace std_msgs::msg
