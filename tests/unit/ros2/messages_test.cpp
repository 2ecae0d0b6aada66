// Which publication a callback took: chains, releases.
#include "ros2_text.hpp"

#include <algorithm>
#include <string>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const std::string kPair = pair_of_period(100);
constexpr const char* kChain = "/a@Timer(100) -> /b@Subscription(/t): 1";

TEST(Ros2Messages, SourceTimestampsOfBothSidesLink) {
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    11 rclcpp_publish pid=1 message=0x99
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    13 rmw_publish pid=1 rmw_publisher_handle=1 message=0x99 timestamp=1000013
    15 callback_end pid=1 callback=0x30
    18 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000013 taken=1
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_THAT(result.chains(), ElementsAre(kChain));
  EXPECT_TRUE(result.instances[1].is_from_known_publisher);
  // Bounds of the response: from the start, and from the source timestamp.
  const auto& callback = result.callback("/b@Subscription(/t)");
  EXPECT_EQ(callback.response_time_lower->max, 3);
  EXPECT_EQ(callback.response_time_upper->max, 23 - 13);
}

// Two runs of the timer and of the subscription. The second release is known from the grid.
constexpr const char* kTwoRuns = R"(
    200 callback_start pid=1 callback=0x30
    211 rclcpp_publish pid=1 message=0x99
    212 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    213 rmw_publish pid=1 rmw_publisher_handle=1 message=0x99 timestamp=1000213
    225 callback_end pid=1 callback=0x30
    228 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000213 taken=1
    230 callback_start pid=2 tid=2 callback=0x50
    237 callback_end pid=2 tid=2 callback=0x50
    300 callback_start pid=1 callback=0x30
    303 rclcpp_publish pid=1 message=0x99
    304 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    305 rmw_publish pid=1 rmw_publisher_handle=1 message=0x99 timestamp=1000305
    307 callback_end pid=1 callback=0x30
    310 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000305 taken=1
    320 callback_start pid=2 tid=2 callback=0x50
    321 callback_end pid=2 tid=2 callback=0x50)";

TEST(Ros2Messages, AChainIsDividedByStartsWhereReleasesAreNotKnown) {
  const auto result = analyze_ros2(kPair + kTwoRuns);
  ASSERT_EQ(result.analysis.report.chains.size(), 1U);
  const auto& chain = result.analysis.report.chains.front();
  EXPECT_FALSE(chain.path_latency);
  ASSERT_TRUE(chain.from_start);
  EXPECT_EQ(chain.from_start->count, 2U);
  EXPECT_EQ(chain.from_start->sum, (237 - 200) + (321 - 300));
  ASSERT_EQ(chain.hop_table.size(), 2U);
  const auto& [timer, subscription] = std::tie(chain.hop_table[0], chain.hop_table[1]);
  EXPECT_EQ(timer.start_to_publish->sum, (211 - 200) + (303 - 300));
  EXPECT_EQ(timer.publish_to_start->sum, (230 - 211) + (320 - 303));
  EXPECT_EQ(timer.publish_to_start->max, 230 - 211);
  EXPECT_EQ(subscription.start_to_publish->sum, (237 - 230) + (321 - 320));
  EXPECT_FALSE(subscription.publish_to_start);
}

// Some messages that a thread takes start no callback that is seen: an action's feedback.
TEST(Ros2Messages, WhatWasTakenForAnotherIsNotTheCallbacks) {
  const auto bounded = [](const std::string& between, const std::string& start) {
    const auto result = analyze_ros2(kPair + R"(
    200 callback_start pid=1 callback=0x30
    204 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    205 rmw_publish pid=1 rmw_publisher_handle=1 message=0x99 timestamp=1000205
    207 callback_end pid=1 callback=0x30
    210 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000205 taken=1
    )" + between + R"(
    230 callback_start pid=2 tid=2 callback=0x50)" +
                                     start + R"(
    237 callback_end pid=2 tid=2 callback=0x50)");
    return !result.analysis.report.chains.empty();
  };
  EXPECT_TRUE(bounded("", " is_intra_process=0"));
  EXPECT_FALSE(bounded("", " is_intra_process=1"));
  EXPECT_FALSE(
      bounded("220 rclcpp_executor_wait_for_work pid=2 tid=2 timeout=-1", " is_intra_process=0"));
}

// Between two messages, by 20 ms: by what the tracer read before, the second one was written when it
// had waited for that long already.
TEST(Ros2Messages, ASourceTimestampIsNoBoundBySettingTheClockForward) {
  const auto result = analyze_ros2(kPair + R"(
    10000000 callback_start pid=1 callback=0x30
    10000004 rclcpp_publish pid=1 message=0x99
    10000005 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    10000010 rmw_publish pid=1 rmw_publisher_handle=1 message=0x99 timestamp=11000008
    10000020 callback_end pid=1 callback=0x30
    10000100 rmw_take pid=2 tid=2 message=0x88 source_timestamp=11000008 taken=1
    10000200 callback_start pid=2 tid=2 callback=0x50
    10000300 callback_end pid=2 tid=2 callback=0x50
    30000000 callback_start pid=1 callback=0x30
    30000004 rclcpp_publish pid=1 message=0x99
    30000005 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    30000010 rmw_publish pid=1 rmw_publisher_handle=1 message=0x99 timestamp=51000008
    30000020 callback_end pid=1 callback=0x30
    60000000 rmw_take pid=2 tid=2 message=0x88 source_timestamp=51000008 taken=1
    60000200 callback_start pid=2 tid=2 callback=0x50
    60000300 callback_end pid=2 tid=2 callback=0x50)");
  const auto& upper = result.callback("/b@Subscription(/t)").response_time_upper;
  ASSERT_TRUE(upper);
  EXPECT_EQ(upper->count, 2U);
  EXPECT_EQ(upper->min, 10'000'300 - 10'000'008);
  EXPECT_EQ(upper->max, 60'000'300 - 30'000'004);
}

// Two subscriptions in process 2; rmw calls them 0xa1 and 0xa2.
constexpr const char* kTwoTopics = R"(
  0 rcl_node_init pid=1 node_handle=0x10 node_name=a namespace=/
  0 rcl_publisher_init pid=1 publisher_handle=0x61 node_handle=0x10 topic_name=/one
  0 rcl_publisher_init pid=1 publisher_handle=0x62 node_handle=0x10 topic_name=/two
  1 rcl_timer_init pid=1 timer_handle=0x20 period=100
  1 rclcpp_timer_callback_added pid=1 timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node pid=1 timer_handle=0x20 node_handle=0x10
  2 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
  2 rcl_subscription_init pid=2 subscription_handle=0x21 node_handle=0x10 rmw_subscription_handle=0xa1 topic_name=/one
  2 rclcpp_subscription_init pid=2 subscription_handle=0x21 subscription=0x41
  2 rclcpp_subscription_callback_added pid=2 subscription=0x41 callback=0x51
  2 rcl_subscription_init pid=2 subscription_handle=0x22 node_handle=0x10 rmw_subscription_handle=0xa2 topic_name=/two
  2 rclcpp_subscription_init pid=2 subscription_handle=0x22 subscription=0x42
  2 rclcpp_subscription_callback_added pid=2 subscription=0x42 callback=0x52
  10 callback_start pid=1 callback=0x30
  12 rcl_publish pid=1 publisher_handle=0x61 message=0x91
  13 rmw_publish pid=1 message=0x91 timestamp=1000013
  62 rcl_publish pid=1 publisher_handle=0x62 message=0x92
  63 rmw_publish pid=1 message=0x92 timestamp=1000063
  65 callback_end pid=1 callback=0x30
)";

// As who uses a rclcpp::WaitSet may do it.
TEST(Ros2Messages, AThreadMayTakeOfManySubscriptionsBeforeItHandlesThem) {
  const auto result = analyze_ros2(std::string(kTwoTopics) + R"(
    70 rmw_take pid=2 tid=2 rmw_subscription_handle=0xa1 source_timestamp=1000013 taken=1
    71 rmw_take pid=2 tid=2 rmw_subscription_handle=0xa2 source_timestamp=1000063 taken=1
    72 callback_start pid=2 tid=2 callback=0x51
    73 callback_end pid=2 tid=2 callback=0x51
    74 callback_start pid=2 tid=2 callback=0x52
    75 callback_end pid=2 tid=2 callback=0x52)");
  EXPECT_THAT(result.chains(), ElementsAre("/a@Timer(100) -> /b@Subscription(/one): 1",
                                           "/a@Timer(100) -> /b@Subscription(/two): 1"));
  EXPECT_EQ(result.callback("/b@Subscription(/one)").response_time_upper->max, 73 - 13);
  EXPECT_EQ(result.callback("/b@Subscription(/two)").response_time_upper->max, 75 - 63);
}

// The callback of /two asks for the newest message of /one itself.
TEST(Ros2Messages, WhatWasTakenOfASubscriptionIsNoOthersMessage) {
  const auto result = analyze_ros2(std::string(kTwoTopics) + R"(
    70 rmw_take pid=2 tid=2 rmw_subscription_handle=0xa1 source_timestamp=1000013 taken=1
    72 callback_start pid=2 tid=2 callback=0x52
    73 callback_end pid=2 tid=2 callback=0x52)");
  EXPECT_THAT(result.chains(), IsEmpty());
  EXPECT_FALSE(result.callback("/b@Subscription(/two)").response_time_upper);
}

// Neither does a timer's callback between take it away, nor what the thread did before it waited give one.
TEST(Ros2Messages, WhatWasTakenIsKeptUntilTheThreadWaits) {
  const auto chains = [](const std::string& between) {
    return analyze_ros2(std::string(kTwoTopics) + R"(
    66 rcl_timer_init pid=2 timer_handle=0x20 period=50
    66 rclcpp_timer_callback_added pid=2 timer_handle=0x20 callback=0x30
    70 rmw_take pid=2 tid=2 rmw_subscription_handle=0xa1 source_timestamp=1000013 taken=1
    )" + between + R"(
    76 callback_start pid=2 tid=2 callback=0x51
    77 callback_end pid=2 tid=2 callback=0x51)")
        .chains();
  };
  EXPECT_THAT(chains("71 callback_start pid=2 tid=2 callback=0x30\n"
                     "72 callback_end pid=2 tid=2 callback=0x30"),
              ElementsAre("/a@Timer(100) -> /b@Subscription(/one): 1"));
  EXPECT_THAT(chains("71 rclcpp_executor_wait_for_work pid=2 tid=2 timeout=-1"), IsEmpty());
}

TEST(Ros2Messages, TheCommunicationLatencyOfATopicIsThatOfTheGraphsEdge) {
  const auto result = analyze_ros2(kPair + kTwoRuns);
  ASSERT_EQ(result.analysis.report.edges.size(), 1U);
  const auto& edge = result.analysis.report.edges.front();
  EXPECT_EQ(edge.topic, "/t");
  ASSERT_TRUE(edge.publish_to_start);
  EXPECT_EQ(edge.publish_to_start->min, 320 - 303);
  EXPECT_EQ(edge.publish_to_start->max, 230 - 211);
}

// The same in milliseconds: a timer's release is calculated from when it was made, up to 10 us too
// early, which bounds the path latency.
TEST(Ros2Messages, AReleaseOfTheGridBoundsThePathLatency) {
  const auto result = analyze_ros2(R"(
    0 rcl_node_init pid=1 node_handle=0x10 node_name=a namespace=/
    0 rcl_publisher_init pid=1 publisher_handle=0x60 node_handle=0x10 topic_name=/t
    10000 rcl_timer_init pid=1 timer_handle=0x20 period=10000000
    10000 rclcpp_timer_callback_added pid=1 timer_handle=0x20 callback=0x30
    10000 rclcpp_timer_link_node pid=1 timer_handle=0x20 node_handle=0x10
    20000 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
    20000 rcl_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1
    20000 rclcpp_subscription_init pid=2 subscription_handle=0x20 subscription=0x40
    20000 rclcpp_subscription_callback_added pid=2 subscription=0x40 callback=0x50
    10050000 callback_start pid=1 callback=0x30
    10060000 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    10061000 rmw_publish pid=1 message=0x99 timestamp=11061000
    10070000 callback_end pid=1 callback=0x30
    10080000 rmw_take pid=2 tid=2 message=0x88 source_timestamp=11061000 taken=1
    10090000 callback_start pid=2 tid=2 callback=0x50
    10100000 callback_end pid=2 tid=2 callback=0x50)");
  ASSERT_EQ(result.analysis.report.chains.size(), 1U);
  const auto& chain = result.analysis.report.chains.front();
  ASSERT_TRUE(chain.from_start);
  EXPECT_EQ(chain.from_start->sum, 10'100'000 - 10'050'000);
  ASSERT_TRUE(chain.path_latency_upper);
  EXPECT_EQ(chain.path_latency_upper->sum, 10'100'000 - 10'000'000);
}

// Galactic: no rmw_take, and rcl_publish is the last that is told of a publication.
TEST(Ros2Messages, WhereNothingTellsWhatWasTakenTheReportSaysSo) {
  const auto text =
      std::string("\n0 rcl_init pid=2 tid=2 context_handle=1 version=2.3.0") + kPair + R"(
    10 callback_start pid=1 callback=0x30
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    15 callback_end pid=1 callback=0x30
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)";
  const auto result = analyze_ros2(text);
  EXPECT_THAT(result.chains(), IsEmpty());
  const auto& processes = result.analysis.report.processes;
  ASSERT_EQ(processes.size(), 2U);
  EXPECT_FALSE(processes[0].tells_messages.has_value());  // it has no subscription
  EXPECT_EQ(processes[1].tells_messages, false);
  EXPECT_EQ(processes[1].tracetools, "2.3.0");
  EXPECT_EQ(analyze_ros2(kPair + kTwoRuns).analysis.report.processes[1].tells_messages, true);
}

TEST(Ros2Messages, WithoutATimestampThatOfTheTakeFallsIntoTheCallOfPublish) {
  // Humble: the writer's timestamp is taken between rmw_publish (13) and the thread's next event.
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    11 rclcpp_publish pid=1 message=0x99
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    13 rmw_publish pid=1 message=0x99
    16 callback_end pid=1 callback=0x30
    18 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000014 taken=1
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_THAT(result.chains(), ElementsAre(kChain));
}

TEST(Ros2Messages, ACallbackMayEndBeforeItsMessagesPublicationIsPutTogether) {
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    11 rclcpp_publish pid=1 message=0x99
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    14 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000013 taken=1
    15 callback_start pid=2 tid=2 callback=0x50
    17 callback_end pid=2 tid=2 callback=0x50
    20 callback_end pid=1 callback=0x30)");
  EXPECT_EQ(result.callback("/b@Subscription(/t)").response_time_upper->max, 17 - 13);
}

TEST(Ros2Messages, TheTakeMayComeWhileThePublisherIsStillInItsCall) {
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    13 rmw_publish pid=1 message=0x99
    18 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000014 taken=1
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50
    30 callback_end pid=1 callback=0x30)");
  EXPECT_THAT(result.chains(), ElementsAre(kChain));
}

TEST(Ros2Messages, TwoCallsThatMayHaveWrittenItLinkNothing) {
  const auto result = analyze_ros2(kPair + R"(
    3 rcl_publisher_init pid=3 publisher_handle=0x60 node_handle=0x10 topic_name=/t
    10 callback_start pid=1 callback=0x30
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    12 rcl_publish pid=3 tid=3 publisher_handle=0x60 message=0x99
    13 rmw_publish pid=1 message=0x99
    13 rmw_publish pid=3 tid=3 message=0x99
    16 callback_end pid=1 callback=0x30
    17 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000014 taken=1
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_THAT(result.chains(), IsEmpty());
  EXPECT_FALSE(result.instances[1].is_from_known_publisher);
}

TEST(Ros2Messages, NothingTakenIsNoMessage) {
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    13 rmw_publish pid=1 message=0x99 timestamp=1000013
    16 callback_end pid=1 callback=0x30
    18 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000013 taken=0
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_THAT(result.chains(), IsEmpty());
}

TEST(Ros2Messages, CaretBindsMessagesToTimestamps) {
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    11 rclcpp_publish pid=1 message=0x99
    12 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    13 ros2_caret:dds_bind_addr_to_stamp pid=1 addr=0x99 source_stamp=555
    15 callback_end pid=1 callback=0x30
    18 dispatch_subscription_callback pid=2 tid=2 message=0x88 callback=0x50 source_stamp=555
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_THAT(result.chains(), ElementsAre(kChain));
}

TEST(Ros2Messages, APublisherThatWasNeverAnnouncedIsUnknown) {
  // rosout's handle is a copy.
  const auto result = analyze_ros2(kPair + R"(
    10 callback_start pid=1 callback=0x30
    12 rcl_publish pid=1 publisher_handle=0x61 message=0x99
    13 rmw_publish pid=1 message=0x99 timestamp=1000013
    16 callback_end pid=1 callback=0x30)");
  EXPECT_EQ(result.durations(), "/a@Timer(100): 1 of 6 to 6\n");
}

TEST(Ros2Messages, MiddlewareThatPublishesForItselfIsNoPublication) {
  const auto result = analyze_ros2(kPair + R"(
    13 rmw_publish pid=1 message=0x99 timestamp=1000013
    18 rmw_take pid=2 tid=2 message=0x88 source_timestamp=1000013 taken=1
    20 callback_start pid=2 tid=2 callback=0x50
    23 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_THAT(result.chains(), IsEmpty());
}

TEST(Ros2Messages, AgnocastNumbersMessages) {
  const auto result = analyze_ros2(R"(
    0 agnocast:agnocast_node_init pid=1 node_handle=0x10 node_name=a namespace=/
    0 agnocast:agnocast_publisher_init pid=1 publisher_handle=0x60 node_handle=0x10 topic_name=/t queue_depth=1
    1 agnocast:agnocast_timer_init pid=1 timer_handle=0x21 node_handle=0x10 callback=0x8 callback_group=0x70 symbol=tick period=100
    2 agnocast:agnocast_node_init pid=2 node_handle=0x10 node_name=b namespace=/
    3 agnocast:agnocast_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 callback=0x9 callback_group=0x70 symbol=take topic_name=/t queue_depth=2 pid_callback_info_id=77
    10 agnocast:agnocast_create_timer_callable pid=1 callable=0x91 timer_handle=0x21
    11 agnocast:agnocast_callable_start pid=1 callable=0x91
    12 agnocast:agnocast_publish pid=1 publisher_handle=0x60 entry_id=5
    13 agnocast:agnocast_callable_end pid=1 callable=0x91
    20 agnocast:agnocast_create_callable pid=2 callable=0x92 entry_id=5 pid_callback_info_id=77
    21 agnocast:agnocast_callable_start pid=2 callable=0x92
    24 agnocast:agnocast_callable_end pid=2 callable=0x92)");
  EXPECT_THAT(result.chains(), ElementsAre(kChain));
}

// Two machines run the same application, so their messages have the same numbers.
TEST(Ros2Messages, AgnocastDoesNotLeaveItsMachine) {
  const auto both = [](const std::string& rest) { return rest + "\n" + rest + " boot=other\n"; };
  std::string text;
  for (
      const auto* event : {
          "0 agnocast:agnocast_node_init node_handle=0x10 node_name=a namespace=/",
          "0 agnocast:agnocast_publisher_init publisher_handle=0x60 node_handle=0x10 topic_name=/t queue_depth=1",
          "1 agnocast:agnocast_timer_init timer_handle=0x21 node_handle=0x10 callback=0x8 callback_group=0x70 symbol=tick period=100",
          "3 agnocast:agnocast_subscription_init subscription_handle=0x20 node_handle=0x10 callback=0x9 callback_group=0x70 symbol=take topic_name=/t queue_depth=2 pid_callback_info_id=77",
          "10 agnocast:agnocast_create_timer_callable callable=0x91 timer_handle=0x21",
          "11 agnocast:agnocast_callable_start callable=0x91",
          "12 agnocast:agnocast_publish publisher_handle=0x60 entry_id=5",
          "13 agnocast:agnocast_callable_end callable=0x91",
          "20 agnocast:agnocast_create_callable callable=0x92 entry_id=5 pid_callback_info_id=77",
          "21 agnocast:agnocast_callable_start callable=0x92",
          "24 agnocast:agnocast_callable_end callable=0x92",
      })
    text += both(event);
  const auto result = analyze_ros2(text);
  const auto& report = result.analysis.report;
  const auto process_of = [&report](analysis::CallbackIndex callback) {
    return std::ranges::find(report.callbacks, callback, &analysis::CallbackReport::index)->process;
  };
  ASSERT_EQ(report.edges.size(), 2U);
  for (const auto& edge : report.edges) {
    ASSERT_TRUE(edge.from);
    EXPECT_EQ(process_of(*edge.from), process_of(edge.to));
  }
}

// Two containers of one machine, each with an IPC namespace, so that the kernel module numbers each
// one's messages of /t. Here process 3 publishes by a number that process 1 has published by.
TEST(Ros2Messages, AgnocastsNumberOfTwoProcessesIsOfNeither) {
  const auto of_number = [](const std::string& number) {
    return analyze_ros2(R"(
    0 agnocast:agnocast_node_init pid=1 node_handle=0x10 node_name=a namespace=/
    0 agnocast:agnocast_publisher_init pid=1 publisher_handle=0x60 node_handle=0x10 topic_name=/t queue_depth=1
    1 agnocast:agnocast_timer_init pid=1 timer_handle=0x21 node_handle=0x10 callback=0x8 callback_group=0x70 symbol=tick period=100
    2 agnocast:agnocast_node_init pid=2 node_handle=0x10 node_name=b namespace=/
    3 agnocast:agnocast_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 callback=0x9 callback_group=0x70 symbol=take topic_name=/t queue_depth=2 pid_callback_info_id=77
    4 agnocast:agnocast_node_init pid=3 node_handle=0x10 node_name=c namespace=/
    4 agnocast:agnocast_publisher_init pid=3 publisher_handle=0x60 node_handle=0x10 topic_name=/t queue_depth=1
    10 agnocast:agnocast_create_timer_callable pid=1 callable=0x91 timer_handle=0x21
    11 agnocast:agnocast_callable_start pid=1 callable=0x91
    12 agnocast:agnocast_publish pid=1 publisher_handle=0x60 entry_id=5
    13 agnocast:agnocast_callable_end pid=1 callable=0x91
    15 agnocast:agnocast_publish pid=3 publisher_handle=0x60 entry_id=)" +
                            number + R"(
    20 agnocast:agnocast_create_callable pid=2 callable=0x92 entry_id=5 pid_callback_info_id=77
    21 agnocast:agnocast_callable_start pid=2 callable=0x92
    24 agnocast:agnocast_callable_end pid=2 callable=0x92)",
                        -1, R"yaml(
callback_groups: []
chains:
  - {name: t, callbacks: ["/a@Timer(100)", "/b@Subscription(/t)"], path_latency: 20}
)yaml");
  };
  EXPECT_THAT(of_number("6").chains(), ElementsAre("t: 1"));
  const auto both = of_number("5");
  EXPECT_THAT(both.chains(), ElementsAre("t: 0"));
  EXPECT_TRUE(both.analysis.report.edges.empty());
  EXPECT_EQ(both.verdict("Q2"), analysis::Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
