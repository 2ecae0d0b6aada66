// The double does as rclcpp does where the executor stands on it.
#include "support/rclcpp/tests/spinning.hpp"

#include <csignal>

namespace cie_rclcpp {
namespace {

using namespace test;

class DoubleTest : public WithContext {};

// rcl_timer_call(): one period on, or as many as it takes not to be in the past.
TEST_F(DoubleTest, ATimerStaysOnItsGrid) {
  const auto clock = std::make_shared<rclcpp::Clock>(RCL_ROS_TIME);
  rcl_clock_t* const time = clock->get_clock_handle();
  rcl_set_ros_time_override(time, 1000);
  rcl_enable_ros_time_override(time);
  const auto timer = rclcpp::create_timer(node("x"), clock, rclcpp::Duration{100ns}, [] {});
  const auto next_after = [&](std::int64_t now) {
    rcl_set_ros_time_override(time, now);
    EXPECT_TRUE(timer->call());
    return now + timer->time_until_trigger().count();
  };
  EXPECT_EQ(next_after(1100), 1200);
  EXPECT_EQ(next_after(1299), 1300);
  EXPECT_EQ(next_after(1400), 1400) << "due just now: it is not over";
  EXPECT_EQ(next_after(1401), 1500);
  EXPECT_EQ(next_after(1950), 2000);
  timer->cancel();
  EXPECT_TRUE(timer->is_canceled());
  EXPECT_FALSE(timer->call());
  timer->reset();
  EXPECT_EQ(timer->time_until_trigger(), 100ns);
  rcl_set_ros_time_override(time, 500);
  EXPECT_EQ(timer->time_until_trigger(), 100ns) << "after a step backwards";
}

TEST_F(DoubleTest, ASubscriptionTellsOfWhatWasMissedBoundedByItsDepth) {
  const auto both = node("both");
  const auto subscription = both->create_subscription<Message>("topic", 3, [](const Message&) {});
  const auto probe = both->create_subscription<Message>("topic", 100, [](const Message&) {});
  const auto publisher = both->create_publisher<Message>("topic", 3);
  std::atomic<int> arrived{0};
  std::atomic<bool> was_other_thread{true};
  probe->set_on_new_message_callback([&, here = std::this_thread::get_id()](std::size_t count) {
    if (std::this_thread::get_id() == here) was_other_thread = false;
    arrived += static_cast<int>(count);
  });
  for (std::uint32_t i = 1; i <= 5; ++i)
    publisher->publish(Message{i});
  EXPECT_TRUE(comes([&] { return arrived == 5; }));
  EXPECT_TRUE(was_other_thread);
  std::vector<std::size_t> told;
  subscription->set_on_new_message_callback([&](std::size_t count) { told.push_back(count); });
  EXPECT_THAT(told, testing::ElementsAre(3U));
  Message message;
  rclcpp::MessageInfo info;
  for (const std::uint32_t kept : {3U, 4U, 5U}) {
    EXPECT_TRUE(subscription->take_type_erased(&message, info));
    EXPECT_EQ(message.data, kept);
  }
  EXPECT_FALSE(subscription->take_type_erased(&message, info));
  probe->clear_on_new_message_callback();
  subscription->clear_on_new_message_callback();
}

// rmw_cyclonedds bounds it by the depth, which it says is 0.
TEST_F(DoubleTest, ASubscriptionThatKeepsAllTellsOfNoneThatWasMissed) {
  const auto both = node("both");
  const auto subscription = both->create_subscription<Message>(
      "topic", rclcpp::QoS{rclcpp::KeepAll()}, [](const Message&) {});
  const auto probe = both->create_subscription<Message>("topic", 100, [](const Message&) {});
  const auto publisher = both->create_publisher<Message>("topic", 3);
  std::atomic<int> arrived{0};
  probe->set_on_new_message_callback(
      [&](std::size_t count) { arrived += static_cast<int>(count); });
  publisher->publish(Message{1});
  EXPECT_TRUE(comes([&] { return arrived == 1; }));
  std::vector<std::size_t> told;
  subscription->set_on_new_message_callback([&](std::size_t count) { told.push_back(count); });
  EXPECT_THAT(told, testing::ElementsAre(0U));
  probe->clear_on_new_message_callback();
  subscription->clear_on_new_message_callback();
}

// As of a message, which is not there.
TEST_F(DoubleTest, ASubscriptionIsToldThatItsLastPublisherHasGone) {
  const auto both = node("both");
  const auto subscription = both->create_subscription<Message>("topic", 3, [](const Message&) {});
  auto one = both->create_publisher<Message>("topic", 3);
  auto other = both->create_publisher<Message>("topic", 3);
  std::atomic<int> told{0};
  subscription->set_on_new_message_callback(
      [&](std::size_t count) { told += static_cast<int>(count); });
  one.reset();
  other->publish(Message{1});
  EXPECT_TRUE(comes([&] { return told == 1; }));
  other.reset();
  EXPECT_TRUE(comes([&] { return told == 2; }));
  Message message;
  rclcpp::MessageInfo info;
  EXPECT_TRUE(subscription->take_type_erased(&message, info));
  EXPECT_FALSE(subscription->take_type_erased(&message, info));
}

TEST_F(DoubleTest, AClientIsToldOfAnswersToOthers) {
  const auto both = node("both");
  const auto service = both->create_service<SetBool>(
      "serve", [](const SetBool::Request::SharedPtr&, const SetBool::Response::SharedPtr&) {});
  const auto one = both->create_client<SetBool>("serve");
  const auto other = both->create_client<SetBool>("serve");
  std::atomic<int> asked{0};
  std::atomic<int> told{0};
  service->set_on_new_request_callback([&](std::size_t) { ++asked; });
  one->set_on_new_response_callback([&](std::size_t) { ++told; });
  other->async_send_request(std::make_shared<SetBool::Request>());
  EXPECT_TRUE(comes([&] { return asked == 1; }));
  auto request = service->create_request();
  rmw_service_info_t info{};
  ASSERT_EQ(rcl_take_request_with_info(service->get_service_handle().get(), &info, request.get()),
            RCL_RET_OK);
  service->handle_request(std::make_shared<rmw_request_id_t>(info.request_id), request);
  EXPECT_TRUE(comes([&] { return told == 1; }));
  const auto response = one->create_response();
  EXPECT_EQ(rcl_take_response_with_info(one->get_client_handle().get(), &info, response.get()),
            RCL_RET_CLIENT_TAKE_FAILED);
  EXPECT_TRUE(comes([&] {
    return rcl_take_response_with_info(other->get_client_handle().get(), &info, response.get()) ==
           RCL_RET_OK;
  }));
}

TEST_F(DoubleTest, AGuardConditionTellsOfWhatCameBefore) {
  rclcpp::GuardCondition condition{context_};
  condition.trigger();
  condition.trigger();
  std::vector<std::size_t> told;
  condition.set_on_trigger_callback([&](std::size_t count) { told.push_back(count); });
  condition.trigger();
  condition.set_on_trigger_callback(nullptr);
  condition.trigger();
  EXPECT_THAT(told, testing::ElementsAre(2U, 1U));
}

TEST(Double, SignalsEndTheContextOnAThreadOfTheirOwn) {
  for (const int signal : {SIGINT, SIGTERM}) {
    rclcpp::init(0, nullptr);
    std::atomic<bool> is_elsewhere{false};
    const auto context = rclcpp::contexts::get_global_default_context();
    const auto handle = context->add_on_shutdown_callback([&, here = std::this_thread::get_id()] {
      is_elsewhere = std::this_thread::get_id() != here;
    });
    std::raise(signal);
    EXPECT_TRUE(comes([] { return !rclcpp::ok(); }));
    EXPECT_TRUE(comes([&] { return is_elsewhere.load(); }));
    EXPECT_FALSE(rclcpp::shutdown()) << "it was already";
    context->remove_on_shutdown_callback(handle);
  }
}

TEST(Double, ArgumentsOfRosAreTakenOut) {
  const char* const arguments[] = {"program", "--a", "--ros-args", "-p", "x:=1", "--", "--b"};
  EXPECT_THAT(rclcpp::remove_ros_arguments(7, arguments),
              testing::ElementsAre("program", "--a", "--b"));
}

}  // namespace
}  // namespace cie_rclcpp
