// An action server and its client, and a subscription that is told of missed deadlines, each in a group of
// its own, under the isolated executor. Sends five goals, waits for their results, says "results 5, missed N",
// and ends.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <example_interfaces/action/fibonacci.hpp>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_action/rclcpp_action.hpp>
#include <std_msgs/msg/u_int32.hpp>

namespace {

using namespace std::chrono_literals;
using Fibonacci = example_interfaces::action::Fibonacci;
using ServerGoal = rclcpp_action::ServerGoalHandle<Fibonacci>;
using ClientGoal = rclcpp_action::ClientGoalHandle<Fibonacci>;

class Actions : public rclcpp::Node {
 public:
  Actions() : Node("actions") {
    const auto group = [this] {
      groups_.push_back(create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive));
      return groups_.back();
    };
    server_ = rclcpp_action::create_server<Fibonacci>(
        this, "fibonacci",
        [](const rclcpp_action::GoalUUID&, const std::shared_ptr<const Fibonacci::Goal>&) {
          return rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE;
        },
        [](const std::shared_ptr<ServerGoal>&) { return rclcpp_action::CancelResponse::ACCEPT; },
        [](const std::shared_ptr<ServerGoal>& goal) {
          goal->publish_feedback(std::make_shared<Fibonacci::Feedback>());
          goal->succeed(std::make_shared<Fibonacci::Result>());
        },
        rcl_action_server_get_default_options(), group());
    client_ = rclcpp_action::create_client<Fibonacci>(this, "fibonacci", group());
    rclcpp::SubscriptionOptions options;
    options.callback_group = group();
    options.event_callbacks.deadline_callback = [this](rclcpp::QOSDeadlineRequestedInfo& info) {
      missed_ += info.total_count_change;
    };
    const auto qos = rclcpp::QoS{10}.deadline(50ms);
    publisher_ = create_publisher<std_msgs::msg::UInt32>("slow", qos);
    subscription_ = create_subscription<std_msgs::msg::UInt32>(
        "slow", qos, [](const std_msgs::msg::UInt32&) {}, options);
  }

  void send_goals() {
    client_->wait_for_action_server(20s);
    publisher_->publish(std_msgs::msg::UInt32{});
    for (int i = 0; i < 5; ++i) {
      rclcpp_action::Client<Fibonacci>::SendGoalOptions options;
      options.result_callback = [this](const ClientGoal::WrappedResult&) { ++results_; };
      client_->async_send_goal(Fibonacci::Goal{}, options);
    }
    for (int i = 0; i < 200 && (results_ < 5 || missed_ == 0); ++i)
      std::this_thread::sleep_for(50ms);
    std::printf("results %d, missed %s\n", results_.load(), missed_ > 0 ? "some" : "none");
  }

 private:
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;
  std::atomic<int> results_{0};
  std::atomic<int> missed_{0};
  rclcpp_action::Server<Fibonacci>::SharedPtr server_;
  rclcpp_action::Client<Fibonacci>::SharedPtr client_;
  rclcpp::Publisher<std_msgs::msg::UInt32>::SharedPtr publisher_;
  rclcpp::Subscription<std_msgs::msg::UInt32>::SharedPtr subscription_;
};

}  // namespace

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  cie_rclcpp::CallbackIsolatedExecutor executor;
  const auto node = std::make_shared<Actions>();
  executor.add_node(node);
  std::thread goals{[&] {
    node->send_goals();
    executor.cancel();
  }};
  executor.spin();
  goals.join();
  rclcpp::shutdown();
  return 0;
}
