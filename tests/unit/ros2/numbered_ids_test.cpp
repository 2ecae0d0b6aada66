// Which of several callbacks of one logical id is which.
#include "ros2_text.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::HasSubstr;

TEST(Ros2Identity, EqualNamesAreNumberedInOrderOfCreation) {
  const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=a namespace=/
    1 rcl_timer_init timer_handle=0x20 period=5
    2 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    3 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    4 rcl_timer_init timer_handle=0x21 period=5
    5 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
    6 rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
    10 callback_start callback=0x31
    11 callback_end callback=0x31
    20 callback_start callback=0x30
    22 callback_end callback=0x30)");
  EXPECT_EQ(result.durations(), "/a@Timer(5): 1 of 2 to 2\n/a@Timer(5)#2: 1 of 1 to 1\n");
}

// Whether the second one takes the first one's place or lives beside it.
TEST(Ros2Identity, CallbacksOfTwoNodesOfOneNameAreNumbered) {
  for (const auto* second : {"0x10", "0x11"}) {
    const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=a namespace=/
    1 rcl_timer_init timer_handle=0x20 period=5
    2 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    3 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    4 rcl_node_init node_name=a namespace=/ node_handle=)" +
                                     std::string(second) + R"(
    5 rcl_timer_init timer_handle=0x21 period=5
    6 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
    7 rclcpp_timer_link_node timer_handle=0x21 node_handle=)" +
                                     second + R"(
    10 callback_start tid=1 callback=0x30
    11 callback_end tid=1 callback=0x30
    20 callback_start tid=2 callback=0x31
    22 callback_end tid=2 callback=0x31)");
    EXPECT_EQ(result.durations(), "/a@Timer(5): 1 of 1 to 1\n/a@Timer(5)#2: 1 of 2 to 2\n");
    EXPECT_EQ(result.verdict("M7"), analysis::Verdict::pass) << second;
    EXPECT_EQ(result.verdict("M5"), analysis::Verdict::not_applicable) << second;
  }
}

// Two timers of one period; the second one runs for 10.
constexpr const char* kTwoOfOneId = R"(
    0 rcl_init context_handle=0x1
    1 rcl_node_init node_handle=0x10 node_name=n namespace=/
    2 rcl_timer_init timer_handle=0x20 period=5
    3 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    4 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    5 rcl_timer_init timer_handle=0x21 period=5
    6 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
    7 rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
    10 callback_start callback=0x31
    20 callback_end callback=0x31
    30 callback_start callback=0x30
    31 callback_end callback=0x30)";
constexpr const char* kFirstIsUrgent =
    "callback_groups:\n  - {id: \"/n@Timer(5)\", response_deadline: 5}\n"
    "  - {id: \"/n@Timer(5)#2\", response_deadline: 1000}\n";
constexpr const char* kSecondIsUrgent =
    "callback_groups:\n  - {id: \"/n@Timer(5)\", response_deadline: 1000}\n"
    "  - {id: \"/n@Timer(5)#2\", response_deadline: 5}\n";

// With the first one's registration the second one's number is lost: it was judged by the entry of the
// first.
TEST(Ros2Identity, TheEntryIsUnknownWhereTheOneBeforeMayBeLost) {
  std::string partly = kTwoOfOneId;
  const auto at = partly.find("2 rcl_timer_init");
  partly.erase(at, partly.find('\n', at) - at);
  EXPECT_EQ(analyze_ros2(kTwoOfOneId, -1, kFirstIsUrgent).verdict("R3"), Verdict::inconclusive);
  const auto result = analyze_ros2(partly, 1, kFirstIsUrgent);
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive);
  EXPECT_EQ(result.callback("/n@Timer(5)").response_deadline, std::nullopt);
  EXPECT_THAT(result.evidence("R3"), HasSubstr("registered after events were lost"));
  const auto untold = analyze_ros2(partly, -1, kFirstIsUrgent);
  EXPECT_EQ(untold.verdict("R3"), Verdict::inconclusive) << "a timer of unknown period is there";
}

TEST(Ros2Identity, NoNumberIsCertainBehindALoss) {
  const auto r3 = [](std::int64_t lost_at) {
    return analyze_ros2(kTwoOfOneId, lost_at, kSecondIsUrgent).verdict("R3");
  };
  EXPECT_EQ(r3(-1), Verdict::fail);
  EXPECT_EQ(r3(1), Verdict::inconclusive);
  EXPECT_EQ(r3(25), Verdict::fail) << "both were registered before";
}

}  // namespace
}  // namespace cie::test
