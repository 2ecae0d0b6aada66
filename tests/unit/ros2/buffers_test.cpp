// Messages that stay within a process: buffers between callbacks, and what is handed over late.
#include "ros2_text.hpp"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::ElementsAre;
using testing::IsEmpty;

// In one process, through a buffer between its callbacks.
constexpr const char* kInside = R"(
  0 rcl_node_init node_handle=0x10 node_name=a namespace=/
  0 rcl_publisher_init publisher_handle=0x60 node_handle=0x10 topic_name=/t
  1 rcl_timer_init timer_handle=0x20 period=100
  1 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
  2 rcl_subscription_init subscription_handle=0x21 node_handle=0x10 topic_name=/t queue_depth=1
  2 rclcpp_buffer_to_ipb buffer=0x80 ipb=0x81
  2 rclcpp_ipb_to_subscription ipb=0x81 subscription=0x41
  2 rclcpp_subscription_callback_added subscription=0x41 callback=0x51
  2 rclcpp_subscription_init subscription_handle=0x21 subscription=0x41
)";

TEST(Ros2Buffers, ABufferInsideTheProcessGivesExactReleases) {
  const auto result = analyze_ros2(std::string(kInside) + R"(
    10 callback_start callback=0x30
    11 rclcpp_intra_publish publisher_handle=0x60 message=0x99
    12 rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=0
    15 callback_end callback=0x30
    18 rclcpp_ring_buffer_dequeue tid=2 buffer=0x80 index=0 size=0
    20 callback_start tid=2 callback=0x51 is_intra_process=1
    23 callback_end tid=2 callback=0x51)");
  EXPECT_THAT(result.chains(), ElementsAre("/a@Timer(100) -> /a@Subscription(/t): 1"));
  EXPECT_EQ(result.instances[1].release, 12);
  EXPECT_EQ(result.callback("/a@Subscription(/t)").response_time->max, 23 - 12);
}

// A second subscription of kInside, to the same topic.
constexpr const char* kSecondInside = R"(
  2 rcl_subscription_init subscription_handle=0x22 node_handle=0x10 topic_name=/t queue_depth=1
  2 rclcpp_buffer_to_ipb buffer=0x90 ipb=0x91
  2 rclcpp_ipb_to_subscription ipb=0x91 subscription=0x42
  2 rclcpp_subscription_callback_added subscription=0x42 callback=0x52
  2 rclcpp_subscription_init subscription_handle=0x22 subscription=0x42
)";

TEST(Ros2Buffers, WhatLeftABufferIsOfTheSubscriptionThatItFeeds) {
  const auto result = analyze_ros2(std::string(kInside) + kSecondInside + R"(
    11 rclcpp_intra_publish publisher_handle=0x60 message=0x99
    12 rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=0
    13 rclcpp_ring_buffer_enqueue buffer=0x90 index=0 size=1 overwritten=0
    18 rclcpp_ring_buffer_dequeue tid=2 buffer=0x80 index=0 size=0
    19 rclcpp_ring_buffer_dequeue tid=2 buffer=0x90 index=0 size=0
    20 callback_start tid=2 callback=0x51 is_intra_process=1
    21 callback_end tid=2 callback=0x51
    22 callback_start tid=2 callback=0x52 is_intra_process=1
    23 callback_end tid=2 callback=0x52)");
  EXPECT_EQ(result.instances[0].release, 12);
  EXPECT_EQ(result.instances[1].release, 13);
}

constexpr const char* kOverwritten = R"(
    11 rclcpp_intra_publish publisher_handle=0x60 message=0x99
    12 rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=0
    13 rclcpp_intra_publish publisher_handle=0x60 message=0x98
    14 rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=1
    18 rclcpp_ring_buffer_dequeue tid=2 buffer=0x80 index=0 size=0
    20 callback_start tid=2 callback=0x51 is_intra_process=1
    23 callback_end tid=2 callback=0x51)";

TEST(Ros2Buffers, AnOverwrittenMessageIsALoss) {
  const auto result = analyze_ros2(std::string(kInside) + kOverwritten);
  EXPECT_EQ(result.instances[0].release, 14);
  EXPECT_THAT(result.evidence("Q1"), testing::HasSubstr("1 sample was overwritten"));
  const auto& callbacks = result.analysis.report.callbacks;
  EXPECT_EQ(std::ranges::count(callbacks, std::optional<std::uint64_t>(1),
                               &analysis::CallbackReport::overwritten_samples),
            1);
  EXPECT_TRUE(std::ranges::none_of(callbacks, [](const analysis::CallbackReport& callback) {
    return callback.lost_samples.has_value();
  }));
}

// The subscription's node was made before the recording: the entry of any node may be its own.
TEST(Ros2Buffers, AnOverwrittenMessageThatMayBeAllowedFailsNothing) {
  std::string text(kInside);
  constexpr std::string_view kMade = "subscription_handle=0x21 node_handle=0x10";
  text.replace(text.find(kMade), kMade.size(), "subscription_handle=0x21 node_handle=0x11");
  const auto verdict = [&](const std::string& id) {
    return analyze_ros2(text + kOverwritten, -1,
                        "callback_groups:\n  - {id: \"" + id + "\", overwrites_allowed: 1}\n")
        .verdict("Q1");
  };
  EXPECT_EQ(verdict("/b@Subscription(/t)"), Verdict::inconclusive);
  EXPECT_EQ(verdict("/b/*"), Verdict::inconclusive);
  EXPECT_EQ(verdict("/b@Subscription(/other)"), Verdict::fail);
}

// A subscription that is made late is handed what publishers of its topic keep (transient local): no event tells who
// published that, and when. It need not be what the callback that makes it has published last.
TEST(Ros2Buffers, AStoredMessageIsOfNoPublicationThatIsKnown) {
  for (const auto* topic : {"/t", "/status"}) {
    const auto result = analyze_ros2(std::string(kInside) + R"(
    3 rcl_publisher_init publisher_handle=0x61 node_handle=0x10 topic_name=)" +
                                     topic + R"(
    10 callback_start callback=0x30
    11 rclcpp_intra_publish publisher_handle=0x61 message=0x99
    12 rcl_subscription_init subscription_handle=0x22 node_handle=0x10 topic_name=/t queue_depth=1
    12 rclcpp_buffer_to_ipb buffer=0x90 ipb=0x91
    12 rclcpp_ipb_to_subscription ipb=0x91 subscription=0x42
    12 rclcpp_subscription_callback_added subscription=0x42 callback=0x52
    12 rclcpp_subscription_init subscription_handle=0x22 subscription=0x42
    13 rclcpp_ring_buffer_enqueue buffer=0x90 index=0 size=1 overwritten=0
    15 callback_end callback=0x30
    18 rclcpp_ring_buffer_dequeue tid=2 buffer=0x90 index=0 size=0
    20 callback_start tid=2 callback=0x52 is_intra_process=1
    23 callback_end tid=2 callback=0x52)");
    EXPECT_THAT(result.chains(), IsEmpty()) << topic;
    EXPECT_TRUE(result.analysis.report.edges.empty()) << topic;
    EXPECT_EQ(result.callback("/a@Subscription(/t)#2").response_time->max, 23 - 13) << topic;
  }
}

TEST(Ros2Buffers, AMessageOfAnotherTopicWasNotHandedOver) {
  const auto result = analyze_ros2(std::string(kInside) + R"(
    3 rcl_publisher_init publisher_handle=0x61 node_handle=0x10 topic_name=/status
    10 callback_start callback=0x30
    11 rclcpp_intra_publish publisher_handle=0x61 message=0x99
    12 rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=0
    15 callback_end callback=0x30
    18 rclcpp_ring_buffer_dequeue tid=2 buffer=0x80 index=0 size=0
    20 callback_start tid=2 callback=0x51 is_intra_process=1
    23 callback_end tid=2 callback=0x51)");
  EXPECT_THAT(result.chains(), IsEmpty());
}

}  // namespace
}  // namespace cie::test
