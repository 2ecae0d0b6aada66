#pragma once

#include <rclcpp/waitable.hpp>

namespace rclcpp::experimental {

class SubscriptionIntraProcessBase : public Waitable {};

}  // namespace rclcpp::experimental
