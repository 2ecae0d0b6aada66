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
