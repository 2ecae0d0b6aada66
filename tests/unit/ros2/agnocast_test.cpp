// Callbacks that agnocast runs.
#include "ros2_text.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;

TEST(Ros2Identity, AgnocastsCallsAreOneCallbackAtManyAddresses) {
  const auto result = analyze_ros2(R"(
    0 agnocast:agnocast_node_init node_handle=0x10 node_name=lidar namespace=/
    1 agnocast:agnocast_subscription_init subscription_handle=0x20 node_handle=0x10 callback=0x9 callback_group=0x70 symbol=take topic_name=/points queue_depth=2 pid_callback_info_id=77
    2 agnocast:agnocast_timer_init timer_handle=0x21 node_handle=0x10 callback=0x8 callback_group=0x70 symbol=tick period=9
    10 agnocast:agnocast_create_callable callable=0x91 entry_id=1 pid_callback_info_id=77
    11 agnocast:agnocast_callable_start callable=0x91
    13 agnocast:agnocast_callable_end callable=0x91
    20 agnocast:agnocast_create_callable callable=0x92 entry_id=2 pid_ciid=77
    21 agnocast:agnocast_callable_start callable=0x92
    24 agnocast:agnocast_callable_end callable=0x92
    30 agnocast:agnocast_create_timer_callable callable=0x91 timer_handle=0x21
    31 agnocast:agnocast_callable_start callable=0x91
    32 agnocast:agnocast_callable_end callable=0x91)");
  EXPECT_EQ(result.durations(),
            "/lidar@Subscription(/points): 2 of 2 to 3\n/lidar@Timer(9): 1 of 1 to 1\n");
}

// agnocast's TakeSubscription tells of a callback that nobody calls, and of no number of it.
TEST(Ros2Identity, AgnocastsPollingSubscriptionIsNoCallback) {
  const auto result = analyze_ros2(R"(
    0 agnocast:agnocast_node_init node_handle=0x10 node_name=lidar namespace=/
    1 agnocast:agnocast_subscription_init subscription_handle=0x30 node_handle=0x10 callback=0x7 callback_group=0x75 symbol=dummy_take/points topic_name=/points queue_depth=1 pid_callback_info_id=0
    2 agnocast:agnocast_subscription_init subscription_handle=0x20 node_handle=0x10 callback=0x9 callback_group=0x70 symbol=take topic_name=/points queue_depth=2 pid_callback_info_id=77
    10 agnocast:agnocast_create_callable callable=0x91 entry_id=1 pid_callback_info_id=77
    11 agnocast:agnocast_callable_start callable=0x91
    13 agnocast:agnocast_callable_end callable=0x91)");
  EXPECT_EQ(result.durations(), "/lidar@Subscription(/points): 1 of 2 to 2\n");
  EXPECT_EQ(result.analysis.report.callbacks.size(), 1U);
}

// A callable is called once; what lies at its address next may be made unseen.
TEST(Ros2Identity, AgnocastsCallableIsNotTakenForTheOneBefore) {
  const std::string node = R"(
    0 agnocast:agnocast_node_init node_handle=0x10 node_name=lidar namespace=/
    1 agnocast:agnocast_subscription_init subscription_handle=0x20 node_handle=0x10 callback=0x9 callback_group=0x70 symbol=take topic_name=/a queue_depth=2 pid_callback_info_id=77
    1 agnocast:agnocast_subscription_init subscription_handle=0x21 node_handle=0x10 callback=0xa callback_group=0x71 symbol=take topic_name=/b queue_depth=2 pid_callback_info_id=78
    10 agnocast:agnocast_create_callable tid=1 callable=0x91 entry_id=1 pid_callback_info_id=77
    11 agnocast:agnocast_callable_start tid=1 callable=0x91
    13 agnocast:agnocast_callable_end tid=1 callable=0x91
)";
  const std::string made =
      "20 agnocast:agnocast_create_callable tid=2 callable=0x91 entry_id=2 pid_callback_info_id=78\n";
  const std::string called = R"(
    21 agnocast:agnocast_callable_start tid=2 callable=0x91
    24 agnocast:agnocast_callable_end tid=2 callable=0x91)";
  EXPECT_EQ(analyze_ros2(node + made + called).durations(),
            "/lidar@Subscription(/a): 1 of 2 to 2\n/lidar@Subscription(/b): 1 of 3 to 3\n");
  const auto lost = analyze_ros2(node + called, 20);
  EXPECT_EQ(lost.verdict("M2"), Verdict::inconclusive);
  EXPECT_EQ(lost.verdict("M3"), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
