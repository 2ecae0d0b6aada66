// Three nodes of rclcpp under the isolated executor: a sensor, a fusion and a plan that calls itself.
// Each callback is in a group of its own, but where an option says otherwise:
//   --client-with-subscription  the client and the subscription of /car/plan share a group
//   --intra-process             messages stay in the process
//   --equal-timers              /car/sensor has two further timers, of equal periods
//   --late                      a node is added, and a subscription created, while it spins
//   --cancel-timer              /car/plan's timer cancels itself at its third run and is reset
//   --throw                     the third run of /car/fusion's timer throws
//   --seconds N                 ends by itself (default: at SIGINT)
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/u_int32.hpp>
#include <std_srvs/srv/set_bool.hpp>

namespace {

using namespace std::chrono_literals;
using Message = std_msgs::msg::UInt32;
using SetBool = std_srvs::srv::SetBool;
using Words = std::set<std::string>;

rclcpp::NodeOptions node_options(const Words& words) {
  return rclcpp::NodeOptions{}.use_intra_process_comms(words.contains("--intra-process"));
}

// Humble takes the middleware's own structure, Iron and later rclcpp's.
template <typename Node>
auto services_qos(Node&) {
  if constexpr (requires(Node & node) {
                  node.template create_client<SetBool>("", rclcpp::ServicesQoS{});
                }) {
    return rclcpp::ServicesQoS{};
  } else {
    return rmw_qos_profile_services_default;
  }
}

class WithGroups : public rclcpp::Node {
 public:
  WithGroups(const std::string& name, const Words& words)
      : Node(name, "/car", node_options(words)) {}

 protected:
  rclcpp::CallbackGroup::SharedPtr own_group() {
    groups_.push_back(create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive));
    return groups_.back();
  }
  rclcpp::SubscriptionOptions in(const rclcpp::CallbackGroup::SharedPtr& group) const {
    rclcpp::SubscriptionOptions options;
    options.callback_group = group;
    return options;
  }

 private:
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;
};

class Sensor : public WithGroups {
 public:
  explicit Sensor(const Words& words) : WithGroups("sensor", words) {
    lidar_ = create_publisher<Message>("lidar", 10);
    camera_ = create_publisher<Message>("camera", 10);
    timers_.push_back(create_wall_timer(
        20ms, [this] { send(*lidar_); }, own_group()));
    timers_.push_back(create_wall_timer(
        50ms, [this] { send(*camera_); }, own_group()));
    if (!words.contains("--equal-timers")) return;
    for (int i = 0; i < 2; ++i) {
      timers_.push_back(create_wall_timer(
          50ms, [] {}, own_group()));
    }
  }

 private:
  void send(rclcpp::Publisher<Message>& publisher) {
    auto message = std::make_unique<Message>();
    message->data = ++sent_;
    publisher.publish(std::move(message));
  }

  std::atomic<std::uint32_t> sent_{0};
  rclcpp::Publisher<Message>::SharedPtr lidar_;
  rclcpp::Publisher<Message>::SharedPtr camera_;
  std::vector<rclcpp::TimerBase::SharedPtr> timers_;
};

class Fusion : public WithGroups {
 public:
  explicit Fusion(const Words& words) : WithGroups("fusion", words) {
    fused_ = create_publisher<Message>("fused", 10);
    for (const char* topic : {"lidar", "camera"}) {
      subscriptions_.push_back(create_subscription<Message>(
          topic, 10, [this](const Message& message) { latest_ = message.data; }, in(own_group())));
    }
    timer_ = create_wall_timer(
        200ms,
        [this, throws = words.contains("--throw")] {
          if (throws && ++runs_ == 3) throw std::runtime_error{"no more fuel"};
          auto message = std::make_unique<Message>();
          message->data = latest_;
          fused_->publish(std::move(message));
        },
        own_group());
  }

 private:
  std::atomic<std::uint32_t> latest_{0};
  int runs_ = 0;
  rclcpp::Publisher<Message>::SharedPtr fused_;
  std::vector<rclcpp::Subscription<Message>::SharedPtr> subscriptions_;
  rclcpp::TimerBase::SharedPtr timer_;
};

class Plan : public WithGroups {
 public:
  explicit Plan(const Words& words) : WithGroups("plan", words) {
    const auto of_subscription = own_group();
    const auto of_client =
        words.contains("--client-with-subscription") ? of_subscription : own_group();
    fused_ = create_subscription<Message>(
        "fused", 10, [](const Message&) {}, in(of_subscription));
    // rclcpp takes these arguments by value. NOLINTBEGIN(performance-unnecessary-value-param)
    service_ = create_service<SetBool>(
        "enable",
        [](const SetBool::Request::SharedPtr request, SetBool::Response::SharedPtr response) {
          response->success = request->data;
        },
        services_qos(*this), own_group());
    // NOLINTEND(performance-unnecessary-value-param)
    client_ = create_client<SetBool>("enable", services_qos(*this), of_client);
    timer_ = create_wall_timer(
        100ms,
        [this, cancels = words.contains("--cancel-timer")] {
          call();
          if (cancels && ++runs_ == 3) timer_->cancel();
        },
        own_group());
  }
  void reset_timer() { timer_->reset(); }

 private:
  void call() {
    auto request = std::make_shared<SetBool::Request>();
    request->data = true;
    // By value, as rclcpp has it. NOLINTNEXTLINE(performance-unnecessary-value-param)
    client_->async_send_request(request, [](rclcpp::Client<SetBool>::SharedFuture) {});
  }

  std::atomic<int> runs_{0};
  rclcpp::Subscription<Message>::SharedPtr fused_;
  rclcpp::Service<SetBool>::SharedPtr service_;
  rclcpp::Client<SetBool>::SharedPtr client_;
  rclcpp::TimerBase::SharedPtr timer_;
};

// What happens while the executor spins.
void interfere(const Words& words, cie_rclcpp::CallbackIsolatedExecutor& executor, Plan& plan) {
  if (words.contains("--late")) {
    std::this_thread::sleep_for(500ms);
    const auto late = std::make_shared<rclcpp::Node>("late", "/car");
    executor.add_node(late);
    auto subscription = late->create_subscription<Message>("lidar", 10, [](const Message&) {});
    std::this_thread::sleep_for(1s);
    subscription.reset();
    std::this_thread::sleep_for(200ms);
    executor.remove_node(late);
  }
  if (words.contains("--cancel-timer")) {
    std::this_thread::sleep_for(1s);
    plan.reset_timer();
  }
}

}  // namespace

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const auto arguments = rclcpp::remove_ros_arguments(argc, argv);
  const Words words{arguments.begin() + 1, arguments.end()};
  int seconds = 0;
  for (std::size_t i = 1; i + 1 < arguments.size(); ++i) {
    if (arguments[i] == "--seconds") seconds = std::atoi(arguments[i + 1].c_str());
  }
  try {
    cie_rclcpp::CallbackIsolatedExecutor executor;
    const auto sensor = std::make_shared<Sensor>(words);
    const auto fusion = std::make_shared<Fusion>(words);
    const auto plan = std::make_shared<Plan>(words);
    executor.add_node(sensor);
    executor.add_node(fusion);
    executor.add_node(plan);
    std::thread other{[&] { interfere(words, executor, *plan); }};
    try {
      if (seconds > 0) {
        executor.spin_for(std::chrono::seconds{seconds});
      } else {
        executor.spin();
      }
    } catch (...) {
      other.join();
      throw;
    }
    other.join();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    rclcpp::shutdown();
    return 4;
  }
  rclcpp::shutdown();
  return 0;
}
