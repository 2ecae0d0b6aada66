// Events that describe one thing refer to each other by handles: who it is does not depend on their order.
#include "ros2_text.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kContext = "0 rcl_init context_handle=0x1\n";

using Descriptions = std::vector<std::string>;

const Descriptions kOfSubscription{
    "rcl_node_init node_handle=0x10 node_name=n namespace=/",
    "rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=7",
    "rclcpp_subscription_init subscription_handle=0x20 subscription=0x40",
    "rclcpp_subscription_callback_added subscription=0x40 callback=0x50",
    "rclcpp_callback_register callback=0x50 symbol=on()"};

const Descriptions kOfTimer{"rcl_timer_init timer_handle=0x20 period=1000",
                            "rclcpp_timer_callback_added timer_handle=0x20 callback=0x50",
                            "rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10",
                            "rclcpp_callback_register callback=0x50 symbol=on()",
                            "rcl_node_init node_handle=0x10 node_name=n namespace=/"};

const Descriptions kOfService{
    "rcl_node_init node_handle=0x10 node_name=n namespace=/",
    "rcl_service_init service_handle=0x20 node_handle=0x10 service_name=/t",
    "rclcpp_service_callback_added service_handle=0x20 callback=0x50",
    "rclcpp_callback_register callback=0x50 symbol=on()"};

// One a nanosecond.
std::string in_this_order(int time, const Descriptions& descriptions) {
  std::string text;
  for (const auto& description : descriptions)
    text += std::to_string(time++) + ' ' + description + '\n';
  return text;
}

// In every order.
template <typename Check>
void in_all_orders(Descriptions descriptions, const Check& check) {
  std::ranges::sort(descriptions);
  do {
    SCOPED_TRACE(in_this_order(0, descriptions));
    check(descriptions);
  } while (std::ranges::next_permutation(descriptions).found);
}

std::string run_of_0x50(int start, int end) {
  return std::to_string(start) + " callback_start callback=0x50\n" + std::to_string(end) +
         " callback_end callback=0x50\n";
}

void expect_in_every_order(const Descriptions& descriptions, const std::string& id) {
  in_all_orders(descriptions, [&id](const Descriptions& order) {
    const auto result = analyze_ros2(kContext + in_this_order(1, order) + run_of_0x50(10, 15) +
                                     run_of_0x50(20, 25));
    ASSERT_THAT(result.logical_ids(), ElementsAre(id));
    const auto& callback = result.callback(id);
    EXPECT_EQ(callback.node, "/n");
    EXPECT_EQ(callback.symbol, "on()");
    EXPECT_EQ(callback.instances, 2U);
    EXPECT_EQ(callback.threads.size(), 1U);
  });
}

TEST(Ros2Descriptions, OfASubscriptionComeInAnyOrder) {
  expect_in_every_order(kOfSubscription, "/n@Subscription(/t)");
}

TEST(Ros2Descriptions, OfATimerComeInAnyOrder) {
  expect_in_every_order(kOfTimer, "/n@Timer(1000)");
}

TEST(Ros2Descriptions, OfAServiceComeInAnyOrder) {
  expect_in_every_order(kOfService, "/n@Service(/t)");
}

TEST(Ros2Descriptions, OfWhatNeverRanComeInAnyOrder) {
  in_all_orders(kOfSubscription, [](const Descriptions& order) {
    EXPECT_THAT(analyze_ros2(kContext + in_this_order(1, order)).logical_ids(),
                ElementsAre("/n@Subscription(/t)"));
  });
}

// The same of one made where it lay, in the order of the first one: all addresses are used again.
void expect_the_next_in_every_order(const Descriptions& descriptions, const std::string& name,
                                    const std::string& next_name, const std::string& ids) {
  in_all_orders(descriptions, [&](Descriptions order) {
    std::erase_if(order, [](const std::string& text) { return text.find("node_init") < 5; });
    const auto first = in_this_order(1, order);
    for (auto& description : order) {
      for (const auto& [old, other] : {std::pair(name, next_name), {"on()", "next()"}}) {
        const auto at = description.find(old);
        if (at != std::string::npos) description.replace(at, old.size(), other);
      }
    }
    const auto result =
        analyze_ros2(kContext + "0 rcl_node_init node_handle=0x10 node_name=n namespace=/\n" +
                     first + run_of_0x50(10, 15) + in_this_order(100, order) +
                     run_of_0x50(120, 127) + run_of_0x50(130, 138));
    EXPECT_EQ(result.durations(), ids);
    const auto last = result.logical_ids().back();
    EXPECT_EQ(result.callback(last).symbol, "next()");
    EXPECT_EQ(result.callback(last).node, "/n");
  });
}

TEST(Ros2Descriptions, OfASubscriptionAtUsedAddressesComeInAnyOrder) {
  expect_the_next_in_every_order(
      kOfSubscription, "=/t ", "=/u ",
      "/n@Subscription(/t): 1 of 5 to 5\n/n@Subscription(/u): 2 of 7 to 8\n");
}

TEST(Ros2Descriptions, OfATimerAtUsedAddressesComeInAnyOrder) {
  expect_the_next_in_every_order(kOfTimer, "period=1000", "period=2000",
                                 "/n@Timer(1000): 1 of 5 to 5\n/n@Timer(2000): 2 of 7 to 8\n");
}

TEST(Ros2Descriptions, OfAServiceAtUsedAddressesComeInAnyOrder) {
  expect_the_next_in_every_order(kOfService, "service_name=/t", "service_name=/u",
                                 "/n@Service(/t): 1 of 5 to 5\n/n@Service(/u): 2 of 7 to 8\n");
}

// The services of a LifecycleNode.
TEST(Ros2Descriptions, OfAHandleThatIsNeverAnnouncedAreNotThoseOfTheNextOne) {
  const auto result = analyze_ros2(kContext + R"(
    1 rcl_node_init node_handle=0x10 node_name=n namespace=/
    2 rclcpp_service_callback_added service_handle=0x20 callback=0x51
    90 rcl_service_init service_handle=0x20 node_handle=0x10 service_name=/t
    91 rclcpp_service_callback_added service_handle=0x20 callback=0x50
)" + run_of_0x50(120, 127));
  EXPECT_EQ(result.durations(), "/n@Service(/t): 1 of 7 to 7\n");
  EXPECT_THAT(result.logical_ids(),
              testing::UnorderedElementsAre("?@Service(?)", "/n@Service(/t)"));
}

TEST(Ros2Descriptions, OfAClientComeInAnyOrder) {
  in_all_orders({"rcl_node_init node_handle=0x10 node_name=n namespace=/",
                 "rcl_client_init client_handle=0x70 node_handle=0x10 service_name=/s "
                 "rmw_client_handle=0x71"},
                [](const Descriptions& order) {
                  const auto result = analyze_ros2(kContext + in_this_order(1, order) + R"(
                    20 rcl_timer_init timer_handle=0x20 period=1000
                    20 rclcpp_timer_callback_added timer_handle=0x20 callback=0x50
                    20 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
)" + run_of_0x50(30, 35));
                  EXPECT_THAT(result.evidence("M2"), HasSubstr("the client of /s (node /n)"));
                });
}

// What was recorded from the middle on may be of a node that was made before.
TEST(Ros2Descriptions, OfANodeThatIsMadeLaterAreNotThoseOfOneThatWasNotRecorded) {
  const auto result = analyze_ros2(R"(
    1 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1
    2 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    3 rclcpp_subscription_callback_added subscription=0x40 callback=0x50
    5 rcl_node_init node_handle=0x10 node_name=later namespace=/
)" + run_of_0x50(10, 15));
  EXPECT_THAT(result.logical_ids(), ElementsAre("?@Subscription(/t)"));
}

}  // namespace
}  // namespace cie::test
