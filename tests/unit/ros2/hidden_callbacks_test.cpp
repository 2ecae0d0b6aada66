// Callbacks that nobody can see: of clients and actions, whose instances ROS 2's events do not show.
#include "ros2_text.hpp"
#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kClient = R"(
  3 rcl_client_init client_handle=0x50 node_handle=0x10 service_name=/enable rmw_client_handle=0x51)";

Ros2Result judged(const std::string& described, const std::string& ran = kIsolated) {
  return analyze_ros2(std::string(kTwoTimers) + described + ran);
}

TEST(HiddenCallbacks, AClientLeavesOpenWhatElseThreadsRan) {
  const auto result = judged(kClient);
  for (const auto* rule : {"M2", "M3", "M4", "E2", "E3"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
  EXPECT_THAT(result.evidence("M2"),
              AllOf(HasSubstr("thread 1: rcl_client_init: may also have served the client "
                              "of /enable (node /n), whose responses ROS 2's events do not show"),
                    HasSubstr("thread 2: rcl_client_init: may also")));
  EXPECT_THAT(result.evidence("M3"), HasSubstr("may also have served"));
  EXPECT_THAT(result.evidence("M6"), HasSubstr("may also have served"));
}

TEST(HiddenCallbacks, WithoutAnyTheMappingIsDecided) {
  const auto result = judged({});
  for (const auto* rule : {"M2", "M3", "M4", "E2", "E3"})
    EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule;
}

// `ros2 trace -u` with a list of events.
TEST(HiddenCallbacks, AreUnknownWhereNoTraceDeclaresWhatTellsOfThem) {
  const auto result = judged("\n0 no_client_events\n");
  for (const auto* rule : {"M2", "M3", "M4", "M6", "E2", "E3"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
  EXPECT_THAT(result.evidence("M2"),
              HasSubstr("thread 1: rcl_init: no trace here declares both ros2:rcl_client_init and "
                        "ros2:rcl_service_init"));
  for (const auto& callback : result.analysis.report.callbacks)
    EXPECT_EQ(callback.isolation, std::nullopt) << callback.logical_id;
}

TEST(HiddenCallbacks, AreKnownWhereAnotherSessionDeclaresWhatTellsOfThem) {
  const std::string first = "\n0 no_client_events\n";
  EXPECT_EQ(judged(first + "3 rmw_publish session=2 message=0x9\n").verdict("M2"), Verdict::pass);
  EXPECT_EQ(judged(first, std::string(kIsolated) + "22 session until=23\n").verdict("M2"),
            Verdict::inconclusive)
      << "that begins later";
}

// What was lost before the window may have told of a client that is there within it.
TEST(HiddenCallbacks, ALossBeforeTheWindowMayHideOne) {
  const std::string text = std::string(kTwoTimers) + kIsolated;
  const analysis::TimeWindow window{.from = analysis::Timestamp{12}, .to = analysis::Timestamp{21}};
  const auto lost = analyze_ros2(text, 4, {}, window);
  for (const auto* rule : {"M2", "M3", "M4", "E2", "E3"}) {
    EXPECT_EQ(analyze_ros2(text, -1, {}, window).verdict(rule), Verdict::pass) << rule;
    EXPECT_EQ(lost.verdict(rule), Verdict::inconclusive) << rule;
  }
  EXPECT_THAT(lost.evidence("M2"), HasSubstr("may have been made then"));
}

TEST(HiddenCallbacks, ALossWithinTheWindowMayHideOne) {
  const auto result = judged("\n3 lost until=4\n");
  for (const auto* rule : {"M2", "M3", "M4", "E2", "E3"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
  for (const auto& rule : result.analysis.verdicts.rules) {
    if (rule.id != "M4") continue;
    for (const auto& subject : rule.subjects)
      EXPECT_EQ(subject.verdict, Verdict::inconclusive) << subject.subject;
  }
}

TEST(HiddenCallbacks, WhatIsSeenToFailFails) {
  const auto result = judged(kClient, R"(
    10 callback_start callback=0x30
    11 callback_end callback=0x30
    12 callback_start callback=0x31
    13 callback_end callback=0x31)");
  EXPECT_EQ(result.verdict("M2"), Verdict::fail);
}

// Of a running system: nothing told what lies at 0x40 and on. A subscription has two addresses, of which
// one is for messages within the process.
TEST(HiddenCallbacks, OfThreeAddressesThatAreUsedInTurnTwoAreSeveralCallbacks) {
  const auto in_turn = [](int addresses) {
    std::string text;
    for (int i = 0; i < 6; ++i) {
      const auto at = std::to_string(100 + 10 * i);
      const auto end = std::to_string(105 + 10 * i);
      const auto address = " callback=0x4" + std::to_string(i % addresses) + "\n";
      text += at + " callback_start" + address + end + " callback_end" + address;
    }
    return analyze_ros2(text);
  };
  const auto three = in_turn(3);
  EXPECT_EQ(three.verdict("M2"), Verdict::fail);
  const auto two = in_turn(2);
  EXPECT_EQ(two.verdict("M2"), Verdict::inconclusive);
  for (const auto& callback : three.analysis.report.callbacks)
    EXPECT_EQ(callback.isolation, analysis::Isolation::not_isolated) << callback.logical_id;
  for (const auto& callback : two.analysis.report.callbacks)
    EXPECT_EQ(callback.isolation, std::nullopt) << callback.logical_id;
}

TEST(HiddenCallbacks, AnActionIsOneHoweverManyServicesItHas) {
  const auto result = judged(R"(
    3 rcl_service_init service_handle=0x60 node_handle=0x10 service_name=/go/_action/send_goal
    3 rcl_service_init service_handle=0x61 node_handle=0x10 service_name=/go/_action/cancel_goal
    3 rcl_service_init service_handle=0x62 node_handle=0x10 service_name=/go/_action/get_result)");
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M2"),
              HasSubstr("rcl_service_init: may also have served the action server of /go (node "
                        "/n), whose instances ROS 2's events do not show"));
}

TEST(HiddenCallbacks, AnActionClientIsOneToo) {
  const auto result = judged(R"(
    3 rcl_client_init client_handle=0x60 node_handle=0x10 service_name=/go/_action/send_goal rmw_client_handle=1
    3 rcl_client_init client_handle=0x61 node_handle=0x10 service_name=/go/_action/get_result rmw_client_handle=2)");
  EXPECT_THAT(result.evidence("M2"), HasSubstr("served the action client of /go (node /n), whose"));
}

TEST(HiddenCallbacks, OthersAreCounted) {
  const auto result = judged(std::string(kClient) + R"(
    3 rcl_client_init client_handle=0x60 node_handle=0x10 service_name=/b rmw_client_handle=0x61
    3 rcl_client_init client_handle=0x70 node_handle=0x10 service_name=/c rmw_client_handle=0x71)");
  EXPECT_THAT(result.evidence("M2"),
              HasSubstr("the client of /enable (node /n) and 2 other "
                        "callbacks, whose instances ROS 2's events do not show"));
}

TEST(HiddenCallbacks, AServiceIsNotHidden) {
  const auto result = judged(R"(
    3 rcl_service_init service_handle=0x60 node_handle=0x10 service_name=/enable
    3 rclcpp_service_callback_added service_handle=0x60 callback=0x61)");
  EXPECT_EQ(result.verdict("M2"), Verdict::pass);
}

// CARET tells groups.
constexpr const char* kGroup = R"(
  4 ros2_caret:add_callback_group callback_group_addr=0x80 group_type_name=mutually_exclusive
  4 ros2_caret:callback_group_add_timer callback_group_addr=0x80 timer_handle=0x20
  4 ros2_caret:callback_group_add_client callback_group_addr=0x80 client_handle=0x50)";

TEST(HiddenCallbacks, OfAKnownGroupConcernTheGroupsThread) {
  const auto result = judged(std::string(kClient) + kGroup);
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M2"), AllOf(HasSubstr("thread 1:"), Not(HasSubstr("thread 2:"))));
  EXPECT_THAT(result.evidence("M3"),
              AllOf(HasSubstr("/n@Timer(1)"), Not(HasSubstr("/n@Timer(2)"))));
}

TEST(HiddenCallbacks, AGroupMayBeToldBeforeItsMembers) {
  const auto result = judged(R"(
    3 ros2_caret:callback_group_add_client callback_group_addr=0x80 client_handle=0x50
    3 ros2_caret:callback_group_add_timer callback_group_addr=0x80 timer_handle=0x20
    3 ros2_caret:rcl_client_init client_handle=0x50 node_handle=0x10 service_name=/enable rmw_client_handle=0x51
    3 ros2_caret:add_callback_group callback_group_addr=0x80 group_type_name=mutually_exclusive)");
  EXPECT_THAT(result.evidence("M2"), AllOf(HasSubstr("thread 1:"), Not(HasSubstr("thread 2:"))));
}

TEST(HiddenCallbacks, OfAGroupInAPoolMayHaveRunAnywhereInTheProcess) {
  const auto result = judged(std::string(kClient) + kGroup, std::string(kIsolated) + R"(
    30 callback_start tid=3 callback=0x30
    31 callback_end tid=3 callback=0x30)");
  EXPECT_THAT(result.evidence("M2"), HasSubstr("thread 2:"));
}

// The client's group was seen on one thread of the pool only.
TEST(HiddenCallbacks, OfAGroupOnAThreadOfAPoolMayHaveRunAnywhereInTheProcess) {
  const auto result = judged(std::string(kClient) + kGroup, std::string(kIsolated) + R"(
    30 callback_start tid=1 callback=0x31
    31 callback_end tid=1 callback=0x31)");
  EXPECT_THAT(result.evidence("M2"), HasSubstr("thread 2: rcl_client_init: may also have served"));
}

// An executor of several threads: by chance each group ran on one of them so far.
TEST(HiddenCallbacks, OfAGroupInAnExecutorOfSeveralThreadsMayHaveRunAnywhereInTheProcess) {
  const auto with = [](const std::string& type) {
    return judged(std::string(kClient) + R"(
      3 ros2_caret:construct_executor executor_addr=0x77 executor_type_name=)" +
                  type + R"(
      4 ros2_caret:add_callback_group executor_addr=0x77 callback_group_addr=0x80 group_type_name=mutually_exclusive
      4 ros2_caret:callback_group_add_timer callback_group_addr=0x80 timer_handle=0x20
      4 ros2_caret:callback_group_add_client callback_group_addr=0x80 client_handle=0x50)");
  };
  for (const auto* rule : {"M2", "E3"}) {
    EXPECT_THAT(with("multi_threaded_executor").evidence(rule),
                HasSubstr("thread 2: rcl_client_init: may also have served"));
    EXPECT_THAT(with("single_threaded_executor").evidence(rule), Not(HasSubstr("thread 2:")));
  }
}

TEST(HiddenCallbacks, WhoTookResponsesIsKnownWhereTheTracerTells) {
  const auto result = judged(kClient, std::string(kIsolated) + R"(
    30 rmw_take_response tid=2 rmw_client_handle=0x51 taken=1)");
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M2"), AllOf(HasSubstr("thread 2: rcl_client_init: also "
                                                     "served the client of /enable (node /n)"),
                                           Not(HasSubstr("thread 1:"))));
}

TEST(HiddenCallbacks, AResponseThatWasNotThereTellsNothing) {
  const auto result = judged(kClient, std::string(kIsolated) + R"(
    30 rmw_take_response tid=2 rmw_client_handle=0x51 taken=0)");
  EXPECT_THAT(result.evidence("M2"), AllOf(HasSubstr("thread 1:"), HasSubstr("thread 2:")));
}

TEST(HiddenCallbacks, OfAnotherProcessConcernThatOne) {
  const auto result = judged(R"(
    3 rcl_init pid=2 tid=3 context_handle=0x1
    3 rcl_client_init pid=2 tid=3 client_handle=0x50 node_handle=0x10 service_name=/enable rmw_client_handle=0x51)");
  EXPECT_EQ(result.verdict("M2"), Verdict::pass);
}

// Without rcl_init nobody knows what was made before.
std::string without_begin() {
  const std::string all = kTwoTimers;
  const auto begin = all.find("  0 rcl_init");
  return all.substr(0, begin) + all.substr(all.find('\n', begin) + 1);
}

TEST(HiddenCallbacks, MayBeOlderThanTheRecording) {
  const auto result = analyze_ros2(without_begin() + kIsolated);
  for (const auto* rule : {"M2", "M3", "M4", "E2", "E3"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
  EXPECT_THAT(result.evidence("M2"), HasSubstr("the process began before the recording"));
}

TEST(HiddenCallbacks, ASecondContextIsNotTheProcessesBegin) {
  const auto result =
      analyze_ros2(without_begin() + "\n  3 rcl_init context_handle=0x2" + kIsolated);
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
}

TEST(HiddenCallbacks, WhatCaretTellsAgainIsAllThatWasMade) {
  const auto result =
      analyze_ros2(without_begin() + "\n  3 ros2_caret:rcl_init context_handle=0x2" + kIsolated);
  EXPECT_EQ(result.verdict("M2"), Verdict::pass);
}

TEST(HiddenCallbacks, ALossLeavesTheMappingOpenWhateverItTook) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated, 5);
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
