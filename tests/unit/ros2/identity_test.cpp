// Who is behind an address: nodes, callbacks, groups.
#include "ros2_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

constexpr const char* kTimerAndNode = R"(
  0 rcl_node_init node_handle=0x10 node_name=talker namespace=/demo
  1 rcl_timer_init timer_handle=0x20 period=1000
  2 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
  3 rclcpp_callback_register callback=0x30 symbol=Talker::tick
  4 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
)";

TEST(Ros2Identity, ATimerHasNodePeriodAndSymbol) {
  const auto result = analyze_ros2(std::string(kTimerAndNode) + R"(
    10 callback_start callback=0x30
    15 callback_end callback=0x30
    20 callback_start callback=0x30
    27 callback_end callback=0x30)");
  const auto& callback = result.callback("/demo/talker@Timer(1000)");
  EXPECT_EQ(callback.node, "/demo/talker");
  EXPECT_EQ(callback.kind, CallbackKind::timer);
  EXPECT_EQ(callback.period_ns, 1000U);
  EXPECT_EQ(callback.symbol, "Talker::tick");
  EXPECT_EQ(callback.instances, 2U);
  EXPECT_EQ(callback.duration->min, 5);
  EXPECT_EQ(callback.duration->max, 7);
  EXPECT_FALSE(callback.isolation) << "it began before the recording: a client may be hidden";
}

TEST(Ros2Identity, WhatATraceDoesNotTellIsNotMeasured) {
  const auto result = analyze_ros2(std::string(kTimerAndNode) + R"(
    10 callback_start callback=0x30
    15 callback_end callback=0x30)");
  const auto& callback = result.callback("/demo/talker@Timer(1000)");
  EXPECT_FALSE(callback.response_time);
  EXPECT_FALSE(callback.missed_releases);
  EXPECT_FALSE(callback.group);
  EXPECT_FALSE(callback.inter_arrival);
}

TEST(Ros2Identity, ContextsNameProcessesAndThreads) {
  const auto result = analyze_ros2(std::string(kTimerAndNode) + R"(
    5 rcl_init context_handle=0x1 procname=talker
    10 callback_start tid=1 callback=0x30 procname=talker
    15 callback_end tid=1 callback=0x30
    20 callback_start tid=2 callback=0x30 procname=worker
    27 callback_end tid=2 callback=0x30
    30 callback_start tid=2 callback=0x30 procname=renamed
    32 callback_end tid=2 callback=0x30
    40 callback_start tid=3 callback=0x30
    42 callback_end tid=3 callback=0x30)");
  const auto& report = result.analysis.report;
  ASSERT_EQ(report.processes.size(), 1U);
  EXPECT_EQ(report.processes[0].name, "talker");
  std::vector<std::string> names;
  for (const auto& thread : report.threads)
    names.push_back(thread.name);
  EXPECT_THAT(names, ElementsAre("talker", "worker", ""));
}

TEST(Ros2Identity, WhatLttngCallsAProcessIsItsName) {
  const auto result =
      analyze_ros2("0 lttng_ust_statedump:procname tid=9 procname=container\n" +
                   std::string(kTimerAndNode) + "5 rcl_init context_handle=0x1 procname=worker");
  ASSERT_EQ(result.analysis.report.processes.size(), 1U);
  EXPECT_EQ(result.analysis.report.processes[0].name, "container");
}

TEST(Ros2Identity, DerivedEventsAreNotCountedAsTheTraces) {
  const auto result = analyze_ros2(std::string(kTimerAndNode) + R"(
    10 callback_start callback=0x30
    15 callback_end callback=0x30)");
  EXPECT_EQ(result.analysis.report.trace.events, 7U);
}

TEST(Ros2Identity, ACallbackThatNeverRanIsListed) {
  EXPECT_THAT(analyze_ros2(kTimerAndNode).logical_ids(), ElementsAre("/demo/talker@Timer(1000)"));
}

TEST(Ros2Identity, TwoAddressesOfOneSubscriptionAreOneCallback) {
  // With communication inside the process a subscription has a second object; that one's callback
  // is added before the object itself is announced.
  const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=fusion namespace=/
    1 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/points queue_depth=3
    2 rclcpp_subscription_callback_added subscription=0x41 callback=0x51
    3 rclcpp_callback_register callback=0x51 symbol=Fusion::take
    4 rclcpp_subscription_init subscription_handle=0x20 subscription=0x41
    5 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    6 rclcpp_subscription_callback_added subscription=0x40 callback=0x50
    7 rclcpp_callback_register callback=0x50 symbol=Fusion::take
    10 callback_start callback=0x50 is_intra_process=0
    12 callback_end callback=0x50
    20 callback_start callback=0x51 is_intra_process=1
    25 callback_end callback=0x51)");
  EXPECT_EQ(result.durations(), "/fusion@Subscription(/points): 2 of 2 to 5\n");
  EXPECT_EQ(result.callback("/fusion@Subscription(/points)").threads.size(), 1U);
}

// Robots made alike are called alike, and their containers have the same pids: their boots tell them apart.
TEST(Ros2Identity, MachinesOfOneNameHaveTheirOwnCallbacks) {
  const auto result = analyze_ros2(R"(
    0 rcl_init context_handle=0x1
    0 rcl_node_init node_handle=0x10 node_name=a namespace=/
    1 rcl_timer_init timer_handle=0x20 period=1
    1 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    1 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    2 rcl_init boot=other context_handle=0x1
    2 rcl_node_init boot=other node_handle=0x10 node_name=b namespace=/
    3 rcl_timer_init boot=other timer_handle=0x20 period=1
    3 rclcpp_timer_callback_added boot=other timer_handle=0x20 callback=0x30
    3 rclcpp_timer_link_node boot=other timer_handle=0x20 node_handle=0x10
    10 callback_start callback=0x30
    12 callback_start boot=other callback=0x30
    14 callback_end callback=0x30
    19 callback_end boot=other callback=0x30)");
  EXPECT_EQ(result.durations(), "/a@Timer(1): 1 of 4 to 4\n/b@Timer(1): 1 of 7 to 7\n");
}

TEST(Ros2Identity, AServiceWhoseHandleWasNeverAnnouncedIsUnknown) {
  const auto result = analyze_ros2(R"(
    0 rclcpp_service_callback_added service_handle=0x20 callback=0x30
    1 rclcpp_callback_register callback=0x30 symbol=change_state
    10 callback_start callback=0x30
    14 callback_end callback=0x30)");
  const auto& callback = result.callback("?@Service(?)");
  EXPECT_EQ(callback.kind, CallbackKind::service);
  EXPECT_EQ(callback.node, "");
  EXPECT_EQ(callback.symbol, "change_state");
  EXPECT_EQ(callback.instances, 1U);
}

TEST(Ros2Identity, ASubscriptionWhoseHandleWasNeverAnnouncedIsOne) {
  constexpr std::string_view kObject =
      "1 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40\n";
  constexpr std::string_view kCallback =
      "1 rclcpp_subscription_callback_added subscription=0x40 callback=0x30\n";
  for (const bool is_object_first : {true, false}) {
    std::string text = "0 rcl_init context_handle=0x1\n";
    text += is_object_first ? kObject : kCallback;
    text += is_object_first ? kCallback : kObject;
    const auto result = analyze_ros2(text + R"(
      10 callback_start callback=0x30
      14 callback_end callback=0x30)");
    EXPECT_EQ(result.callback("?@Subscription(?)").kind, CallbackKind::subscription);
    EXPECT_EQ(result.verdict("R2"), Verdict::not_applicable) << "of timers";
    EXPECT_EQ(result.verdict("Q1"), Verdict::inconclusive) << "nothing tells what it lost";
  }
}

// A LifecycleNode has such a one beside its parameter services.
TEST(Ros2Identity, WhatIsBesideACallbackThatIsKnownInPartIsDoubtedForThat) {
  const auto result = analyze_ros2(R"(
    0 rcl_init context_handle=0x1
    0 rcl_node_init node_handle=0x10 node_name=n namespace=/
    1 rcl_service_init service_handle=0x20 node_handle=0x10 service_name=/s
    2 rclcpp_service_callback_added service_handle=0x20 callback=0x30
    3 rclcpp_service_callback_added service_handle=0x21 callback=0x31)");
  EXPECT_EQ(result.verdict("M7"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M7"), HasSubstr("registered in part only, and may be of its id"));
  EXPECT_EQ(result.verdict("R2"), Verdict::not_applicable) << "services have no periods";
}

// Those of a LifecycleNode, which is loaded again.
TEST(Ros2Identity, AServiceThatIsRegisteredAgainIsAnotherOne) {
  const auto result = analyze_ros2(R"(
    0 rclcpp_service_callback_added service_handle=0x20 callback=0x30
    10 callback_start callback=0x30
    14 callback_end callback=0x30
    20 rclcpp_service_callback_added service_handle=0x20 callback=0x30
    30 callback_start callback=0x30
    37 callback_end callback=0x30)");
  EXPECT_EQ(result.durations(), "?@Service(?): 1 of 4 to 4\n?@Service(?)#2: 1 of 7 to 7\n");
}

// Whichever of the two was announced.
TEST(Ros2Identity, AServiceWhoseHandleWasNeverAnnouncedIsNotTheOneThatHadItBeforeNorAfter) {
  const std::string node = "0 rcl_node_init node_handle=0x10 node_name=n namespace=/\n";
  const std::string init =
      " rcl_service_init service_handle=0x20 node_handle=0x10 service_name=/s\n";
  const auto added = [](int time, const std::string& callback) {
    return std::to_string(time) +
           " rclcpp_service_callback_added service_handle=0x20 callback=" + callback + '\n';
  };
  const std::string first_runs = "10 callback_start callback=0x30\n14 callback_end callback=0x30\n";
  const std::string second_runs = "30 callback_start callback=0x31\n37 callback_end callback=0x31";
  EXPECT_EQ(analyze_ros2(node + "1" + init + added(2, "0x30") + first_runs + added(20, "0x31") +
                         second_runs)
                .durations(),
            "/n@Service(/s): 1 of 4 to 4\n?@Service(?): 1 of 7 to 7\n");
  EXPECT_EQ(analyze_ros2(node + added(2, "0x30") + first_runs + "19" + init + added(20, "0x31") +
                         second_runs)
                .durations(),
            "?@Service(?): 1 of 4 to 4\n/n@Service(/s): 1 of 7 to 7\n");
}

TEST(Ros2Identity, AnAddressThatIsUsedAgainIsAnotherCallback) {
  const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=rviz namespace=/
    1 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/map queue_depth=1
    2 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    3 rclcpp_subscription_callback_added subscription=0x40 callback=0x50
    10 callback_start callback=0x50
    11 callback_end callback=0x50
    20 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/path queue_depth=1
    21 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    22 rclcpp_subscription_callback_added subscription=0x40 callback=0x50
    30 callback_start callback=0x50
    32 callback_end callback=0x50
    40 callback_start callback=0x50
    43 callback_end callback=0x50)");
  EXPECT_EQ(result.durations(),
            "/rviz@Subscription(/map): 1 of 1 to 1\n"
            "/rviz@Subscription(/path): 2 of 2 to 3\n");
}

TEST(Ros2Identity, AReusedObjectIsNotTakenForTheOldOneWhenItsCallbackComesFirst) {
  const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=rviz namespace=/
    1 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/map queue_depth=1
    2 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    3 rclcpp_subscription_callback_added subscription=0x40 callback=0x50
    20 rcl_subscription_init subscription_handle=0x21 node_handle=0x10 topic_name=/path queue_depth=1
    21 rclcpp_subscription_callback_added subscription=0x40 callback=0x51
    22 rclcpp_subscription_init subscription_handle=0x21 subscription=0x40
    30 callback_start callback=0x51
    32 callback_end callback=0x51)");
  EXPECT_EQ(result.durations(), "/rviz@Subscription(/path): 1 of 2 to 2\n");
}

// The address goes on to /path, and the handle that it was of to /scan.
TEST(Ros2Identity, AnAddressIsNoLongerThatOfTheHandleWhichHadItBefore) {
  const auto made = [](int time, const std::string& topic, const std::string& handle,
                       const std::string& object, const std::string& callback) {
    const auto at = '\n' + std::to_string(time) + ' ';
    return at +
           "rcl_subscription_init node_handle=0x10 queue_depth=1 subscription_handle=" + handle +
           " topic_name=" + topic + at + "rclcpp_subscription_init subscription_handle=" + handle +
           " subscription=" + object + at +
           "rclcpp_subscription_callback_added subscription=" + object + " callback=" + callback;
  };
  const auto result = analyze_ros2("0 rcl_node_init node_handle=0x10 node_name=rviz namespace=/" +
                                   made(1, "/map", "0x20", "0x40", "0x50") +
                                   made(2, "/path", "0x21", "0x41", "0x50") + R"(
    10 callback_start callback=0x50
    11 callback_end callback=0x50)" +
                                   made(20, "/scan", "0x20", "0x42", "0x51") + R"(
    30 callback_start callback=0x50
    33 callback_end callback=0x50)");
  EXPECT_EQ(result.durations(), "/rviz@Subscription(/path): 2 of 1 to 3\n");
}

TEST(Ros2Identity, APeriodThatWasNotToldIsUnknown) {
  const std::string rest = R"(
    2 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    3 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    10 callback_start callback=0x30
    11 callback_end callback=0x30)";
  const std::string node = "0 rcl_node_init node_handle=0x10 node_name=a namespace=/\n";
  EXPECT_THAT(analyze_ros2(node + rest).logical_ids(), ElementsAre("/a@Timer(?)"));
  EXPECT_THAT(
      analyze_ros2(node + "1 rcl_timer_init timer_handle=0x20 period=0\n" + rest).logical_ids(),
      ElementsAre("/a@Timer(0)"));
}

TEST(Ros2Identity, ProcessesHaveTheirOwnAddresses) {
  const auto result = analyze_ros2(R"(
    0 rcl_node_init pid=1 node_handle=0x10 node_name=a namespace=/
    0 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
    1 rcl_timer_init pid=1 timer_handle=0x20 period=5
    1 rcl_timer_init pid=2 timer_handle=0x20 period=7
    2 rclcpp_timer_callback_added pid=1 timer_handle=0x20 callback=0x30
    2 rclcpp_timer_callback_added pid=2 timer_handle=0x20 callback=0x30
    3 rclcpp_timer_link_node pid=1 timer_handle=0x20 node_handle=0x10
    3 rclcpp_timer_link_node pid=2 timer_handle=0x20 node_handle=0x10)");
  EXPECT_THAT(result.logical_ids(), ElementsAre("/a@Timer(5)", "/b@Timer(7)"));
}

TEST(Ros2Identity, CaretRepeatsWhatWasThereBeforeTheRecording) {
  const auto result = analyze_ros2(std::string(kTimerAndNode) + R"(
    10 callback_start callback=0x30
    15 callback_end callback=0x30
    20 ros2_caret:rcl_node_init node_handle=0x10 node_name=talker namespace=/demo
    21 ros2_caret:rcl_timer_init timer_handle=0x20 period=1000
    22 ros2_caret:rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    24 ros2_caret:rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    30 callback_start callback=0x30
    36 callback_end callback=0x30)");
  EXPECT_EQ(result.durations(), "/demo/talker@Timer(1000): 2 of 5 to 6\n");
}

// CARET tells of what was made before its recording while that runs.
TEST(Ros2Identity, WhatRanBeforeItIsNamedIsTheSameCallback) {
  const auto result = analyze_ros2(R"(
    10 callback_start callback=0x30
    15 callback_end callback=0x30
    16 callback_start callback=0x51
    19 callback_end callback=0x51
    20 ros2_caret:rcl_node_init node_handle=0x10 node_name=n namespace=/
    21 ros2_caret:rcl_timer_init timer_handle=0x20 period=1000
    22 ros2_caret:rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    24 callback_start callback=0x30
    26 callback_end callback=0x30
    27 ros2_caret:rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    28 ros2_caret:rcl_subscription_init subscription_handle=0x21 node_handle=0x10 topic_name=/t queue_depth=1
    28 ros2_caret:rclcpp_subscription_init subscription_handle=0x21 subscription=0x41
    28 ros2_caret:rclcpp_subscription_callback_added subscription=0x41 callback=0x51
    30 callback_start callback=0x30
    36 callback_end callback=0x30
    40 callback_start callback=0x51
    44 callback_end callback=0x51)");
  EXPECT_EQ(result.durations(), "/n@Timer(1000): 3 of 2 to 6\n/n@Subscription(/t): 2 of 3 to 4\n");
}

TEST(Ros2Identity, OneThatIsNamedAfterAnotherOfItsIdIsToldApart) {
  const auto result = analyze_ros2(R"(
    10 callback_start callback=0x31
    15 callback_end callback=0x31
    20 ros2_caret:rcl_node_init node_handle=0x10 node_name=n namespace=/
    21 ros2_caret:rcl_timer_init timer_handle=0x20 period=1000
    21 ros2_caret:rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    21 ros2_caret:rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    22 callback_start tid=2 callback=0x30
    25 callback_end tid=2 callback=0x30
    31 ros2_caret:rcl_timer_init timer_handle=0x21 period=1000
    31 ros2_caret:rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
    31 ros2_caret:rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
    40 callback_start callback=0x31
    47 callback_end callback=0x31)");
  EXPECT_THAT(result.logical_ids(), UnorderedElementsAre("/n@Timer(1000)", "/n@Timer(1000)#2"));
  EXPECT_EQ(result.callback("/n@Timer(1000)#2").instances, 2U);
  EXPECT_EQ(result.verdict("M7"), analysis::Verdict::pass);
}

// Of one that is made where an unnamed one lay this tells nothing.
TEST(Ros2Identity, ACallbackThatIsMadeNowHasNotRunBefore) {
  const auto result = analyze_ros2(R"(
    10 callback_start callback=0x30
    15 callback_end callback=0x30
    20 rcl_node_init node_handle=0x10 node_name=n namespace=/
    21 rcl_timer_init timer_handle=0x20 period=1000
    22 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    23 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    30 callback_start callback=0x30
    36 callback_end callback=0x30)");
  EXPECT_EQ(result.callback("/n@Timer(1000)").instances, 1U);
}

TEST(Ros2Identity, CaretTellsGroups) {
  const auto result = analyze_ros2(std::string(kTimerAndNode) + R"(
    5 ros2_caret:add_callback_group executor_addr=1 callback_group_addr=0x70 group_type_name=mutually_exclusive
    6 ros2_caret:callback_group_add_timer callback_group_addr=0x70 timer_handle=0x20
    10 callback_start callback=0x30
    15 callback_end callback=0x30)");
  EXPECT_TRUE(result.callback("/demo/talker@Timer(1000)").group);
}

// Half of its name may be another one's.
TEST(Ros2Identity, IsUnknownWhereAPartOfItWasLost) {
  constexpr const char* kSpec =
      "callback_groups:\n  - {id: \"/n@Timer(1)\", response_deadline: 1000}\n"
      "  - {id: \"/n/*\", response_deadline: 1}\n";
  const std::string run = "10 callback_start callback=0x30\n20 callback_end callback=0x30";
  const auto r3 = [&](std::string text, std::string_view lost) {
    if (!lost.empty()) {
      const auto at = text.find(lost);
      text.erase(at, text.find('\n', at) - at);
    }
    return analyze_ros2(text + run, lost.empty() ? -1 : 1, kSpec).verdict("R3");
  };
  EXPECT_EQ(r3(kTwoTimers, "1 rcl_timer_init timer_handle=0x20"), Verdict::inconclusive);
  EXPECT_EQ(r3(kTwoTimers, "0 rcl_node_init"), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
