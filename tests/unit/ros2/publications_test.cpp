// What is one publication: layers of ROS 2 tell of a message more than once.
#include "ros2_text.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

// A timer of process 1 publishes on /t, to a subscription of its own process and to one of process 2.
constexpr const char* kTwoSubscriptions = R"(
  0 rcl_node_init pid=1 node_handle=0x10 node_name=a namespace=/
  0 rcl_publisher_init pid=1 publisher_handle=0x60 node_handle=0x10 topic_name=/t
  1 rcl_timer_init pid=1 timer_handle=0x20 period=7
  1 rclcpp_timer_callback_added pid=1 timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node pid=1 timer_handle=0x20 node_handle=0x10
  2 rcl_subscription_init pid=1 subscription_handle=0x21 node_handle=0x10 rmw_subscription_handle=0xa1 topic_name=/t queue_depth=1
  2 rclcpp_buffer_to_ipb pid=1 buffer=0x80 ipb=0x81
  2 rclcpp_ipb_to_subscription pid=1 ipb=0x81 subscription=0x41
  2 rclcpp_subscription_callback_added pid=1 subscription=0x41 callback=0x51
  2 rclcpp_subscription_init pid=1 subscription_handle=0x21 subscription=0x41
  3 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
  3 rcl_subscription_init pid=2 subscription_handle=0x21 node_handle=0x10 rmw_subscription_handle=0xa2 topic_name=/t queue_depth=1
  3 rclcpp_subscription_init pid=2 subscription_handle=0x21 subscription=0x41
  3 rclcpp_subscription_callback_added pid=2 subscription=0x41 callback=0x51
)";
constexpr const char* kInProcess = "/a@Timer(7) -> /a@Subscription(/t): 1";
constexpr const char* kBetween = "/a@Timer(7) -> /b@Subscription(/t): 1";

// Of process 1 the instance that publishes, and the one that is given the message.
std::string published_inside(const std::string& between) {
  return std::string(kTwoSubscriptions) + R"(
    10 callback_start pid=1 callback=0x30
    11 rclcpp_intra_publish pid=1 publisher_handle=0x60 message=0x99
    12 rclcpp_ring_buffer_enqueue pid=1 buffer=0x80 index=0 size=1 overwritten=0
)" + between +
         R"(
    20 callback_end pid=1 callback=0x30
    21 rclcpp_ring_buffer_dequeue pid=1 buffer=0x80 index=0 size=0
    22 callback_start pid=1 callback=0x51 is_intra_process=1
    25 callback_end pid=1 callback=0x51
)";
}
std::string taken_outside(std::int64_t source_timestamp) {
  return "30 rmw_take pid=2 rmw_subscription_handle=0xa2 message=0x77 source_timestamp=" +
         std::to_string(source_timestamp) +
         " taken=1\n31 callback_start pid=2 callback=0x51\n35 callback_end pid=2 callback=0x51\n";
}

TEST(Ros2Publications, AMessageInsideAndBetweenProcessesIsOne) {
  const auto result = analyze_ros2(published_inside(R"(
    13 rclcpp_publish pid=1 message=0x99
    14 rcl_publish pid=1 publisher_handle=0x60 message=0x99
    16 rmw_publish pid=1 rmw_publisher_handle=0x1 message=0x99 timestamp=1000015)") +
                                   taken_outside(1'000'015));
  EXPECT_EQ(result.publications, 1U);
  EXPECT_THAT(result.chains(), UnorderedElementsAre(kInProcess, kBetween));
}

// Where one subscription wants to own its message, the others are given a copy. Distributions that
// tell no source timestamps, with CARET.
TEST(Ros2Publications, SoItIsIfOneOfThemIsACopy) {
  const auto result = analyze_ros2(published_inside(R"(
    13 rclcpp_publish pid=1 message=0x98
    14 rcl_publish pid=1 publisher_handle=0x60 message=0x97
    16 rmw_publish pid=1 message=0x97)") +
                                   taken_outside(1'000'015));
  EXPECT_EQ(result.publications, 1U);
  EXPECT_THAT(result.chains(), UnorderedElementsAre(kInProcess, kBetween));
}

TEST(Ros2Publications, TwoCallsAreTwo) {
  const auto result = analyze_ros2(published_inside(R"(
    13 rclcpp_intra_publish pid=1 publisher_handle=0x60 message=0x98
    14 rclcpp_publish pid=1 message=0x98
    14 rcl_publish pid=1 publisher_handle=0x60 message=0x98
    16 rmw_publish pid=1 rmw_publisher_handle=0x1 message=0x98 timestamp=1000015)"));
  EXPECT_EQ(result.publications, 2U);
}

TEST(Ros2Publications, NoTakeIsOfAMessageThatStaysInItsProcess) {
  const auto result = analyze_ros2(published_inside("") + taken_outside(1'000'009));
  EXPECT_EQ(result.publications, 1U);
  EXPECT_THAT(result.chains(), ElementsAre(kInProcess));
}

// On thread 1 of process 1; process 2 takes it 10 ns later.
std::string published_and_taken(int time) {
  const auto at = [time](int after) { return std::to_string(time + after); };
  const auto stamp = std::to_string(kRealtimeOffset + time + 1);
  return at(0) + " rclcpp_publish pid=1 message=0x99\n" + at(0) +
         " rcl_publish pid=1 publisher_handle=0x60 message=0x99\n" + at(2) +
         " rmw_publish pid=1 rmw_publisher_handle=0x1 message=0x99 timestamp=" + stamp + "\n" +
         at(10) +
         " rmw_take pid=2 rmw_subscription_handle=0xa2 message=0x77 taken=1 source_timestamp=" +
         stamp + "\n" + at(11) + " callback_start pid=2 callback=0x51\n" + at(12) +
         " callback_end pid=2 callback=0x51\n";
}

// rmw's handle of the publisher of /t.
constexpr const char* kRmwHandle = R"(
  5 rcl_publisher_init pid=1 publisher_handle=0x60 node_handle=0x10 rmw_publisher_handle=0xb0 topic_name=/t
)";

// "FROM: MESSAGES" of each edge.
std::vector<std::string> messages(const Ros2Result& result) {
  const auto& report = result.analysis.report;
  std::vector<std::string> edges;
  for (const auto& edge : report.edges) {
    edges.push_back((edge.from ? report.callbacks[analysis::at(*edge.from)].logical_id : "nobody") +
                    ": " + std::to_string(edge.messages));
  }
  return edges;
}

constexpr const char* kRun =
    "50 callback_start pid=1 callback=0x30\n51 callback_end pid=1 callback=0x30\n";

// Whoever was given the message may run before the thread that published it tells of that.
TEST(Ros2Publications, AMessageMayBeTakenBeforeItsPublicationIsTold) {
  std::string text = kTwoSubscriptions;
  for (const int time : {10'000, 20'000, 30'000}) {
    const auto at = [time](int after) { return '\n' + std::to_string(time + after); };
    const auto stamp = std::to_string(kRealtimeOffset + time + 4);
    text += at(0) + " callback_start pid=1 tid=1 callback=0x30" + at(1) +
            " rclcpp_publish pid=1 tid=1 message=0x99" + at(2) +
            " rcl_publish pid=1 tid=1 publisher_handle=0x60 message=0x99" + at(5) +
            " rmw_take pid=2 tid=2 rmw_subscription_handle=0xa2 taken=1 source_timestamp=" + stamp +
            at(6) + " callback_start pid=2 tid=2 callback=0x51" + at(7) +
            " callback_end pid=2 tid=2 callback=0x51" + at(8) +
            " rmw_publish pid=1 tid=1 message=0x99 timestamp=" + stamp + at(9) +
            " callback_end pid=1 tid=1 callback=0x30";
  }
  const auto result = analyze_ros2(text);
  EXPECT_THAT(result.chains(), ElementsAre("/a@Timer(7) -> /b@Subscription(/t): 3"));
}

// What is serialized already, a generic publisher's messages and those of publish(SerializedMessage),
// rcl does not tell of; rclcpp tells of the first alone.
TEST(Ros2Publications, AMessageThatIsSerializedAlreadyIsOfThePublisherThatRmwNames) {
  const auto published = [](const std::string& by_user, const std::string& handle) {
    return std::string(kTwoSubscriptions) + kRmwHandle + "10 callback_start pid=1 callback=0x30\n" +
           by_user +
           "16 rmw_publish pid=1 message=0x99 timestamp=1000015 rmw_publisher_handle=" + handle +
           "\n20 callback_end pid=1 callback=0x30\n" + taken_outside(1'000'015);
  };
  constexpr const char* kGeneric = "13 rclcpp_publish pid=1 message=0x99\n";
  for (const auto* by_user : {kGeneric, ""}) {
    const auto result = analyze_ros2(published(by_user, "0xb0"));
    EXPECT_EQ(result.publications, 1U) << by_user;
    EXPECT_THAT(result.chains(), ElementsAre(kBetween)) << by_user;
    EXPECT_THAT(messages(result), ElementsAre("/a@Timer(7): 1")) << by_user;
    // What rmw itself publishes, of which rcl knows nothing, is no publication of the user's.
    EXPECT_EQ(analyze_ros2(published(by_user, "0xb1")).publications, 0U) << by_user;
  }
}

// The timer runs again: what it ran before was left. What the thread publishes outside of callbacks is
// then of nobody.
TEST(Ros2Publications, WhatAnExceptionLeftPublishesNothing) {
  const std::string open = R"(
    10 callback_start pid=1 callback=0x30
    12 rclcpp_executor_get_next_ready pid=1
)";
  const auto left = kTwoSubscriptions + open;
  const auto later = analyze_ros2(left + kRun + published_and_taken(60));
  EXPECT_THAT(messages(later), ElementsAre("nobody: 1"));
  const std::string reentrant = R"(
    4 ros2_caret:callback_group_add_timer pid=1 callback_group_addr=0x70 timer_handle=0x20
    4 ros2_caret:add_callback_group pid=1 executor_addr=0x1 callback_group_addr=0x70 group_type_name=reentrant
)";
  EXPECT_THAT(
      messages(analyze_ros2(kTwoSubscriptions + reentrant + open + kRun + published_and_taken(60))),
      IsEmpty())
      << "it may have begun inside itself";
  // Before, it is undecided whether it spins inside.
  const auto before = analyze_ros2(left + published_and_taken(14));
  EXPECT_THAT(messages(before), IsEmpty());
  const auto both = analyze_ros2(left + published_and_taken(14) + kRun + published_and_taken(60));
  EXPECT_THAT(messages(both), ElementsAre("nobody: 1"));
}

// What an instance publishes that was not seen to end need not be its own, executors' events or not.
TEST(Ros2Publications, WhatIsPublishedBeforeAnEndThatNothingTellsViolatesNoBound) {
  const auto of = [](const std::string& end) {
    return analyze_ros2(kTwoSubscriptions + ("10 callback_start pid=1 callback=0x30\n" +
                                             published_and_taken(60) + end),
                        -1, R"yaml(
callback_groups: []
chains:
  - name: scan
    callbacks: ["/a@Timer(7)", "/b@Subscription(/t)"]
    path_latency: 5
)yaml");
  };
  EXPECT_EQ(of("80 callback_end pid=1 callback=0x30").verdict("Q2"), analysis::Verdict::fail);
  const auto result = of("");
  EXPECT_EQ(result.verdict("Q2"), analysis::Verdict::inconclusive);
  EXPECT_THAT(result.evidence("Q2"), testing::HasSubstr("was not seen to end"));
}

// What began inside and was left, too.
TEST(Ros2Publications, WhatEndsIsLeftByWhatBeganInside) {
  const auto result = analyze_ros2(std::string(kTwoSubscriptions) + R"(
    10 callback_start pid=1 callback=0x30
    12 callback_start pid=1 callback=0x51
    14 callback_end pid=1 callback=0x30
)" + published_and_taken(60));
  EXPECT_THAT(messages(result), ElementsAre("nobody: 1"));
}

TEST(Ros2Publications, ACallbackMaySpinAndPublish) {
  std::string events = published_and_taken(14);
  events.insert(events.find("24 rmw_take"), "20 callback_end pid=1 callback=0x30\n");
  const auto result = analyze_ros2(std::string(kTwoSubscriptions) + R"(
    10 callback_start pid=1 callback=0x30
    11 rclcpp_executor_wait_for_work pid=1 timeout=1
    12 rclcpp_executor_get_next_ready pid=1
)" + events);
  EXPECT_THAT(messages(result), ElementsAre("/a@Timer(7): 1"));
}

}  // namespace
}  // namespace cie::test
