// Starts and ends: pairing, nesting, what a recording's bounds cut.
#include "ros2_text.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

TEST(Ros2Instances, NestedCallbacksPairByThreadAndAddress) {
  // The service of a component container runs other callbacks while it loads a component.
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    12 callback_start callback=0x31
    13 callback_end callback=0x31
    14 callback_start callback=0x31
    16 callback_end callback=0x31
    20 callback_end callback=0x30)");
  EXPECT_EQ(result.durations(), "/n@Timer(1): 1 of 10 to 10\n/n@Timer(2): 2 of 1 to 2\n");
}

TEST(Ros2Instances, ThreadsDoNotMixUp) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start tid=1 callback=0x30
    11 callback_start tid=2 callback=0x30
    14 callback_end tid=1 callback=0x30
    17 callback_end tid=2 callback=0x30)");
  EXPECT_EQ(result.durations(), "/n@Timer(1): 2 of 4 to 6\n");
}

TEST(Ros2Instances, AStartThatIsSkippedHasNoEnd) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    12 callback_start callback=0x31
    20 callback_end callback=0x30)");
  EXPECT_EQ(result.durations(), "/n@Timer(1): 1 of 10 to 10\n");
  EXPECT_EQ(result.callback("/n@Timer(2)").incomplete, 1U);
}

// Its number is none that a tracer gave, so its end is none of what was lost.
TEST(Ros2Instances, OneThatAnExceptionLeftIsNotMissing) {
  const auto with = [](const std::string& between) {
    return analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    11 callback_end callback=0x30
    20 callback_start callback=0x30
)" + between + R"(
    30 callback_start callback=0x30
    31 callback_end callback=0x30
    40 callback_start tid=2 callback=0x31
    41 callback_end tid=2 callback=0x31)");
  };
  const auto result = with("");
  for (const auto* rule : {"M2", "M3", "M4", "E1"})
    EXPECT_EQ(result.verdict(rule), analysis::Verdict::pass) << rule << result.evidence(rule);
  EXPECT_THAT(result.evidence("E1"), testing::HasSubstr("an exception ends it"));
  const auto& defects = result.analysis.report.defects;
  EXPECT_EQ(
      std::ranges::count(defects, analysis::DefectKind::seq_gaps, &analysis::TraceDefect::kind), 0);
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 2U);
  EXPECT_EQ(result.callback("/n@Timer(1)").incomplete, 1U);
  EXPECT_EQ(with("    22 lost until=25\n").verdict("E1"), analysis::Verdict::inconclusive);
}

TEST(Ros2Instances, WhenAnExceptionEndedOneIsNotKnown) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    20 callback_start callback=0x30
    21 callback_end callback=0x30)",
                                   -1, R"yaml(
callback_groups:
  - {id: "/n@Timer(1)", response_deadline: 100}
)yaml");
  EXPECT_EQ(result.verdict("R3"), analysis::Verdict::inconclusive);
}

TEST(Ros2Instances, AStartBeforeALossIsNotPairedWithAnEndAfterIt) {
  // Between them another end and another start may have been lost.
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    90 callback_end callback=0x30)",
                                   50);
  EXPECT_EQ(result.durations(), "");
  EXPECT_EQ(result.callback("/n@Timer(1)").incomplete, 1U);
}

TEST(Ros2Instances, OpenAtTheEnd) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30)");
  EXPECT_EQ(result.callback("/n@Timer(1)").incomplete, 1U);
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 0U);
}

TEST(Ros2Instances, AnEndBeforeTheFirstStartIsCutByTheBegin) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    5 callback_end callback=0x30
    10 callback_start callback=0x30
    12 callback_end callback=0x30)");
  EXPECT_EQ(result.durations(), "/n@Timer(1): 1 of 2 to 2\n");
  ASSERT_EQ(result.instances.size(), 1U);
}

TEST(Ros2Instances, CallbacksMadeBeforeTheRecordingAreMeasuredWithoutAName) {
  const auto result = analyze_ros2(R"(
    10 callback_start callback=0x30
    12 callback_end callback=0x30)");
  ASSERT_EQ(result.analysis.report.callbacks.size(), 1U);
  const auto& callback = result.analysis.report.callbacks.front();
  EXPECT_EQ(callback.logical_id.front(), '?');
  EXPECT_EQ(callback.duration->max, 2);
  EXPECT_EQ(result.verdict("M2"), analysis::Verdict::inconclusive);
}

TEST(Ros2Instances, WhatRanUnnamedIsTheCallbackThatIsAnnouncedLater) {
  const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=n namespace=/
    1 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1
    2 rclcpp_subscription_callback_added subscription=0x40 callback=0x50
    3 callback_start callback=0x50
    4 callback_end callback=0x50
    5 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    6 callback_start callback=0x50
    9 callback_end callback=0x50)");
  EXPECT_EQ(result.durations(), "/n@Subscription(/t): 2 of 1 to 3\n");
}

TEST(Ros2Instances, AnExecutorsWaitEndsWithItsNextLookAround) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    5 rclcpp_executor_wait_for_work timeout=100
    9 rclcpp_executor_get_next_ready
    10 callback_start callback=0x30
    12 callback_end callback=0x30
    13 rclcpp_executor_get_next_ready
    14 callback_start callback=0x30
    15 callback_end callback=0x30)");
  ASSERT_EQ(result.instances.size(), 2U);
  EXPECT_EQ(result.instances[0].wakeup, 9);
  EXPECT_EQ(result.instances[1].wakeup, -1);  // it did not wait in between
}

// Most often nothing lies between: then one event tells of both, as fast as of one.
TEST(Ros2Instances, AStartTellsOfTheEndThatFollowsAtOnce) {
  const std::string begin = std::string(kTwoTimers) + kIsolated;  // where both are announced
  const auto in_all = [&begin](const std::string& lines) {
    return analyze_ros2(begin + lines).ended_at_once - analyze_ros2(begin).ended_at_once;
  };
  EXPECT_EQ(in_all("30 callback_start tid=1 callback=0x30\n"
                   "31 callback_end tid=1 callback=0x30\n"),
            1U);
  EXPECT_EQ(in_all("30 callback_start tid=1 callback=0x30\n"
                   "31 callback_start tid=2 callback=0x31\n"
                   "32 callback_end tid=2 callback=0x31\n"
                   "33 callback_end tid=1 callback=0x30\n"),
            1U);
  EXPECT_EQ(in_all("30 callback_start tid=1 cpu=0 callback=0x30\n"
                   "31 callback_end tid=1 cpu=1 callback=0x30\n"),
            0U);
  EXPECT_EQ(in_all("30 callback_start tid=1 callback=0x30\n"
                   "31 rclcpp_publish tid=1 message=0x7\n"
                   "32 callback_end tid=1 callback=0x30\n"),
            0U);
}

// Too many begun on a thread and never ended: the first of them is given up as the next one begins,
// whether that ends at once or not.
TEST(Ros2Instances, TheFirstOfTooManyOpenOnesIsGivenUp) {
  std::string text = std::string(kTwoTimers) + kIsolated;
  std::int64_t time = 30;
  text += std::to_string(time++) + " callback_start tid=1 callback=0x30\n";
  for (int i = 0; i < 63; ++i)
    text += std::to_string(time++) + " callback_start tid=1 callback=0x31\n";
  text += std::to_string(time++) + " callback_start tid=1 callback=0x30\n";
  text += std::to_string(time++) + " callback_end tid=1 callback=0x30\n";
  const auto result = analyze_ros2(text);
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 3U);
  EXPECT_EQ(result.callback("/n@Timer(1)").incomplete, 1U);
  EXPECT_EQ(result.callback("/n@Timer(2)").incomplete, 63U);
}

// Where a thread's CPUs were read back each of its events is checked, an end that its start tells of
// as well.
TEST(Ros2Instances, BothEndsAreCheckedAgainstAllowedCpus) {
  std::string text = std::string(kTwoTimers) + kIsolated;
  text += "29 cie:thread_sched tid=1 moment=initial cpus=0\n";
  for (std::int64_t time = 30; time < 50; time += 2) {
    text += std::to_string(time) + " callback_start tid=1 callback=0x30\n";
    text += std::to_string(time + 1) + " callback_end tid=1 callback=0x30\n";
  }
  const auto result = analyze_ros2(text);
  std::vector<std::uint64_t> checked;
  for (const auto& rule : result.analysis.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      if (rule.id == "S4" && subject.subject == "thread 1") checked.push_back(subject.checked);
    }
  }
  EXPECT_EQ(checked, (std::vector<std::uint64_t>{20}));
  EXPECT_NE(result.verdict("S4"), analysis::Verdict::not_applicable);
}

}  // namespace
}  // namespace cie::test
