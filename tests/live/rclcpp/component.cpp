// A component with a subscription and a timer, each in a group of its own.
#include <chrono>
#include <vector>

#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <std_msgs/msg/u_int32.hpp>

namespace test_components {

class Echo : public rclcpp::Node {
 public:
  explicit Echo(const rclcpp::NodeOptions& options) : Node("echo", options) {
    for (int i = 0; i < 2; ++i)
      groups_.push_back(create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive));
    publisher_ = create_publisher<std_msgs::msg::UInt32>("echoed", 10);
    rclcpp::SubscriptionOptions of_subscription;
    of_subscription.callback_group = groups_[0];
    subscription_ = create_subscription<std_msgs::msg::UInt32>(
        "echoed", 10, [](const std_msgs::msg::UInt32&) {}, of_subscription);
    timer_ = create_wall_timer(
        std::chrono::milliseconds{20}, [this] { publisher_->publish(std_msgs::msg::UInt32{}); },
        groups_[1]);
  }

 private:
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;
  rclcpp::Publisher<std_msgs::msg::UInt32>::SharedPtr publisher_;
  rclcpp::Subscription<std_msgs::msg::UInt32>::SharedPtr subscription_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace test_components

RCLCPP_COMPONENTS_REGISTER_NODE(test_components::Echo)
