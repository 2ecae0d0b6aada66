// Each kind of entity is made and dropped while the middleware tells of it: for the sanitizers.
#include "support/rclcpp/tests/spinning.hpp"

#include <functional>

namespace cie_rclcpp {
namespace {

using namespace test;

class ChurnTest : public WithContext {
 protected:
  // `make` again and again, its result dropped at once or a little later, beside `busy`.
  void churn(const std::function<std::shared_ptr<void>(rclcpp::Node&)>& make,
             const std::function<void()>& busy) {
    const auto changing = node("changing");
    executor_.add_node(changing);
    const Spinning spinning{executor_};
    std::atomic<bool> is_over{false};
    std::thread other{[&] {
      while (!is_over)
        busy();
    }};
    const auto end = std::chrono::steady_clock::now() + 300ms;
    std::shared_ptr<void> former;
    for (int i = 0; std::chrono::steady_clock::now() < end; ++i) {
      auto made = make(*changing);
      if (i % 3 == 0) std::this_thread::sleep_for(1ms);
      former = i % 2 == 0 ? std::move(made) : nullptr;
    }
    is_over = true;
    other.join();
  }

  CallbackIsolatedExecutor executor_{cie::ExecutorOptions{}, in_context()};
};

TEST_F(ChurnTest, Subscriptions) {
  const auto steady = node("steady");
  const auto publisher = steady->create_publisher<Message>("x", 10);
  std::atomic<int> received{0};
  churn(
      [&](rclcpp::Node& changing) {
        return changing.create_subscription<Message>("x", 10, [&](const Message&) { ++received; });
      },
      [&] { publisher->publish(Message{1}); });
}

TEST_F(ChurnTest, HandlersOfEventsThatOutliveTheirSubscription) {
  const auto steady = node("steady");
  const auto publisher = steady->create_publisher<Message>("x", 10);
  std::atomic<int> received{0};
  churn(
      [&](rclcpp::Node& changing) -> std::shared_ptr<void> {
        const auto subscription =
            changing.create_subscription<Message>("x", 10, [&](const Message&) { ++received; });
        std::this_thread::sleep_for(1ms);
        return subscription->get_event_handlers().begin()->second;
      },
      [&] { publisher->publish(Message{1}); });
}

TEST_F(ChurnTest, SubscriptionsThroughTheProcess) {
  const auto inside =
      std::make_shared<rclcpp::Node>("inside", "/test", options().use_intra_process_comms(true));
  executor_.add_node(inside);
  const auto publisher = inside->create_publisher<Message>("x", 10);
  std::atomic<int> received{0};
  churn(
      [&](rclcpp::Node&) {
        return inside->create_subscription<Message>("x", 10, [&](const Message&) { ++received; });
      },
      [&] { publisher->publish(Message{1}); });
}

TEST_F(ChurnTest, ServicesAndClients) {
  const auto steady = node("steady");
  const auto asking = steady->create_client<SetBool>("serve");
  churn(
      [&](rclcpp::Node& changing) -> std::shared_ptr<void> {
        struct Both {
          std::shared_ptr<void> service;
          rclcpp::Client<SetBool>::SharedPtr client;
        };
        Both both{
            changing.create_service<SetBool>("serve", [](const SetBool::Request::SharedPtr&,
                                                         const SetBool::Response::SharedPtr&) {}),
            changing.create_client<SetBool>("serve")};
        both.client->async_send_request(std::make_shared<SetBool::Request>());
        return std::make_shared<Both>(std::move(both));
      },
      [&] {
        asking->async_send_request(std::make_shared<SetBool::Request>());
        std::this_thread::sleep_for(100us);
      });
}

TEST_F(ChurnTest, TimersThatAreReset) {
  std::atomic<int> runs{0};
  std::mutex mutex;
  std::weak_ptr<rclcpp::TimerBase> latest;
  churn(
      [&](rclcpp::Node& changing) -> std::shared_ptr<void> {
        auto timer = changing.create_wall_timer(100us, [&] { ++runs; });
        const std::lock_guard lock{mutex};
        latest = timer;
        return timer;
      },
      [&] {
        std::shared_ptr<rclcpp::TimerBase> timer;
        {
          const std::lock_guard lock{mutex};
          timer = latest.lock();
        }
        if (!timer) return;
        timer->cancel();
        timer->reset();
      });
}

TEST_F(ChurnTest, EventsOfPublishersAndSubscriptions) {
  const auto steady = node("steady");
  const auto picky = steady->create_subscription<Message>("x", 10, [](const Message&) {});
  std::atomic<int> events{0};
  churn(
      [&](rclcpp::Node& changing) -> std::shared_ptr<void> {
        rclcpp::PublisherOptions handled;
        handled.event_callbacks.incompatible_qos_callback =
            [&](rclcpp::QOSOfferedIncompatibleQoSInfo&) { ++events; };
        return changing.create_publisher<Message>("x", rclcpp::QoS{1}.best_effort(), handled);
      },
      [] { std::this_thread::sleep_for(1ms); });
}

}  // namespace
}  // namespace cie_rclcpp
