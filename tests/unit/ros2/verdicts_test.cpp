// What such a recording proves, and what it cannot.
#include "support/verdicts.hpp"

#include "ros2_text.hpp"
#include "timer_text.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::HasSubstr;
using testing::Not;

TEST(Ros2Verdicts, AnIsolatedMappingHoldsWhereNothingWasLost) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  EXPECT_EQ(result.verdict("M2"), Verdict::pass);
  EXPECT_EQ(result.verdict("M3"), Verdict::pass);
}

TEST(Ros2Verdicts, TwoCallbacksOnOneThreadViolateIt) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    11 callback_end callback=0x30
    12 callback_start callback=0x31
    13 callback_end callback=0x31)");
  EXPECT_EQ(result.verdict("M2"), Verdict::fail);
}

// A thread may have ended, and the next one have its tid.
TEST(Ros2Verdicts, CallbacksThatCameOneAfterTheOtherMayBeOfTwoThreadsWithOneTid) {
  const auto runs = [](const std::string& tid, const std::vector<std::string>& callbacks) {
    std::string text(kTwoTimers);
    auto time = 10;
    for (const auto& callback : callbacks) {
      for (const auto* event : {" callback_start", " callback_end"}) {
        text += std::to_string(time++) + event;
        text += " tid=" + tid + " callback=" + callback + "\n";
      }
    }
    return analyze_ros2(text);
  };
  const auto apart = runs("7", {"0x30", "0x30", "0x31"});
  EXPECT_EQ(apart.verdict("M2"), Verdict::inconclusive);
  EXPECT_THAT(apart.evidence("M2"), HasSubstr("no event of ROS 2 tells that a thread ends"));
  EXPECT_EQ(runs("7", {"0x30", "0x31", "0x30"}).verdict("M2"), Verdict::fail) << "by turns";
  EXPECT_EQ(runs("1", {"0x30", "0x30", "0x31"}).verdict("M2"), Verdict::fail)
      << "the main thread is there as long as its process";
}

TEST(Ros2Verdicts, CallbacksThatCameOneAfterTheOtherAreOfOneThreadIfTheKernelSawNoExit) {
  const std::string runs = R"(
    10 callback_start tid=7 callback=0x30
    11 callback_end tid=7 callback=0x30
    20 callback_start tid=7 callback=0x31
    21 callback_end tid=7 callback=0x31
)";
  const std::string seen =
      "\n5 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=120";
  EXPECT_EQ(analyze_ros2(kTwoTimers + seen + runs).verdict("M2"), Verdict::fail);
  const auto with_hole = analyze_ros2(kTwoTimers + seen + "\n12 kernel_lost 15" + runs);
  EXPECT_EQ(with_hole.verdict("M2"), Verdict::inconclusive);
}

// The timer of period 1 went on on thread 8. What runs on a thread 7 later may be on another one.
TEST(Ros2Verdicts, AThreadThatACallbackLeftMayBeAnotherOneSince) {
  const auto with = [](const std::string& before) {
    return analyze_ros2(kTwoTimers + before + R"(
    10 callback_start tid=7 callback=0x30
    11 callback_end tid=7 callback=0x30
    20 callback_start tid=8 callback=0x30
    21 callback_end tid=8 callback=0x30
    30 callback_start tid=7 callback=0x31
    31 callback_end tid=7 callback=0x31
    40 callback_start tid=8 callback=0x30
    41 callback_end tid=8 callback=0x30
)");
  };
  const auto result = with("");
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive) << result.evidence("M3");
  EXPECT_EQ(result.verdict("M4"), Verdict::inconclusive) << result.evidence("M4");
  const auto there = with(R"(
    5 callback_start tid=7 callback=0x31
    6 callback_end tid=7 callback=0x31
)");
  EXPECT_EQ(there.verdict("M3"), Verdict::fail) << "it ran the other timer before and after";
  EXPECT_EQ(there.verdict("M4"), Verdict::pass);
}

// No event tells when a thread ended: thread 7 was still there when thread 8 ran the timer.
TEST(Ros2Verdicts, ACallbackThatLeavesAThreadAliveViolatesTheMapping) {
  const std::string moved = R"(
    10 callback_start tid=7 callback=0x30
    11 callback_end tid=7 callback=0x30
    20 callback_start tid=8 callback=0x30
    21 callback_end tid=8 callback=0x30
    )";
  const std::string alive =
      "sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=120";
  EXPECT_EQ(analyze_ros2(kTwoTimers + moved).verdict("M3"), Verdict::inconclusive);
  const auto result = analyze_ros2(kTwoTimers + moved + "30 " + alive);
  EXPECT_EQ(result.verdict("M3"), Verdict::fail);
  EXPECT_THAT(result.evidence("M3"), HasSubstr("sched_switch: thread 7 still runs"));
  const auto with_hole = analyze_ros2(kTwoTimers + moved + "25 kernel_lost 27\n30 " + alive);
  EXPECT_EQ(with_hole.verdict("M3"), Verdict::inconclusive);
}

// Nobody tells what threads ran as: what is not known of either lifetime is not alike.
TEST(Ros2Verdicts, ARestartedProcessIsNotKnownToReturnAsItWas) {
  const auto life = [](std::int64_t from, const std::string& pid) {
    const auto at = [&](std::int64_t time, const std::string& event) {
      return std::to_string(from + time) + ' ' + event + " pid=" + pid + " tid=" + pid;
    };
    return at(0, "rcl_init context_handle=0x1") + '\n' + at(1, "rcl_node_init node_handle=0x10") +
           " node_name=n namespace=/\n" + at(2, "rcl_timer_init timer_handle=0x20") +
           " period=5\n" + at(3, "rclcpp_timer_callback_added timer_handle=0x20") +
           " callback=0x30\n" + at(4, "rclcpp_timer_link_node timer_handle=0x20") +
           " node_handle=0x10\n" + at(10, "callback_start callback=0x30") + '\n' +
           at(12, "callback_end callback=0x30") + '\n' + at(20, "sched:sched_process_exit") + '\n';
  };
  const auto result = analyze_ros2(life(0, "7") + life(1000, "8"));
  EXPECT_EQ(result.verdict("M5"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M5"), HasSubstr("do not tell what its threads ran as"));
}

// Of what was made before the recording one may have the same id, and be the first of them.
TEST(Ros2Verdicts, OneThatIsMadeBesideANamelessOneIsOfAnUnknownEntry) {
  const auto judged = [](const char* before) {
    return analyze_ros2(std::string(before) + R"(
    10 callback_start tid=1 callback=0x30
    11 callback_end tid=1 callback=0x30
    20 rcl_node_init node_handle=0x10 node_name=a namespace=/
    21 rcl_timer_init timer_handle=0x21 period=5
    22 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
    23 rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
    30 callback_start tid=2 callback=0x31
    39 callback_end tid=2 callback=0x31)",
                        -1, "callback_groups:\n  - {id: \"/a@Timer(5)\", response_deadline: 2}\n");
  };
  EXPECT_EQ(judged("0 rcl_init context_handle=0x1").verdict("R3"), Verdict::fail);
  EXPECT_EQ(judged("").verdict("R3"), Verdict::inconclusive);
}

TEST(Ros2Verdicts, ALossLeavesEverythingOpenBecauseNothingIsNumbered) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated, 15);
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("T2"), Verdict::inconclusive);
}

TEST(Ros2Verdicts, NumbersThatTheRecordingDoesNotHaveAreNotContiguous) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  EXPECT_EQ(result.verdict("T3"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("T3"), HasSubstr("numbers no instances"));
}

TEST(Ros2Verdicts, SkippedPeriodsAreNotTold) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
}

TEST(Ros2Verdicts, TotalsOfACallbackThatNeverRanAreMissingSinceItWasMade) {
  const auto result = analyze_ros2(R"(
    5 rcl_node_init node_handle=0x10 node_name=n namespace=/
    6 rcl_subscription_init subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1
    7 rclcpp_subscription_init subscription_handle=0x20 subscription=0x40
    8 rclcpp_subscription_callback_added subscription=0x40 callback=0x30
    9 rcl_node_init node_handle=0x11 node_name=other namespace=/)");
  const auto& rules = result.analysis.verdicts.rules;
  const auto q1 = std::ranges::find(rules, "Q1", &analysis::RuleVerdict::id);
  ASSERT_NE(q1, rules.end());
  const auto& evidence = q1->subjects.at(0).evidence.at(0);
  EXPECT_EQ(evidence.event, "") << "ROS 2 has no event that tells it";
  EXPECT_EQ(evidence.time->ns, 9);  // told when the recording ends
}

// What is missing is told with a position in time, not with an event of that name.
TEST(Ros2Verdicts, EvidenceNamesNoEventThatTheRecordingLacks) {
  const std::set<std::string> lacking{
      "run_begin",   "run_end",     "callback_init", "callback_fini", "callback_release",
      "thread_init", "thread_fini", "thread_sched",  "sched_switch",  "sched_process_exit"};
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated, -1,
                                   "callback_groups:\n  - id: /none@Timer(1)\n");
  std::size_t told = 0;
  for (const auto& rule : result.analysis.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      for (const auto& item : subject.evidence) {
        ++told;
        EXPECT_FALSE(lacking.contains(item.event))
            << rule.id << ' ' << item.event << ' ' << item.note.code;
      }
    }
  }
  EXPECT_GT(told, 0U);
}

TEST(Ros2Verdicts, EventsOfThisProjectAreNotAskedFor) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  EXPECT_EQ(result.verdict("T5"), Verdict::pass);
  EXPECT_EQ(result.analysis.verdicts.verdict, Verdict::inconclusive);
}

constexpr const char* kLate = R"(
  1 rcl_timer_init timer_handle=0x20 period=1
  1 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30)";

TEST(Ros2Verdicts, WhatIsMissingIsNamed) {
  const auto result = analyze_ros2(std::string(kLate) + kIsolated);
  EXPECT_EQ(result.verdict("T5"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("T5"), HasSubstr("rcl_init"));
  EXPECT_THAT(result.evidence("T5"), Not(HasSubstr("run_begin")));
  EXPECT_THAT(result.evidence("T4"), HasSubstr("no rcl_init of this process"));
}

bool has_defect(const Ros2Result& result, analysis::DefectKind kind) {
  return std::ranges::find(result.analysis.report.defects, kind, &analysis::TraceDefect::kind) !=
         result.analysis.report.defects.end();
}

// Nobody announces them again, as this project's executor does to those who attach.
TEST(Ros2Verdicts, WhoAttachedIsToldHowRos2DescribesCallbacks) {
  const auto result = analyze_ros2(kIsolated);
  const auto& defects = result.analysis.report.defects;
  const auto found = std::ranges::find(defects, analysis::DefectKind::unregistered_callbacks,
                                       &analysis::TraceDefect::kind);
  ASSERT_NE(found, defects.end());
  EXPECT_EQ(found->count, 2U);
  EXPECT_THAT(found->advice, HasSubstr("describe a callback once, when it is made"));
}

TEST(Ros2Verdicts, AProcessBeginsWithItsFirstContext) {
  const auto whole = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  EXPECT_FALSE(has_defect(whole, analysis::DefectKind::missing_run_begin));
  EXPECT_FALSE(has_defect(whole, analysis::DefectKind::missing_run_end));
  EXPECT_TRUE(whole.analysis.report.processes.at(0).complete);
  const auto late = analyze_ros2(std::string(kLate) + kIsolated);
  EXPECT_TRUE(has_defect(late, analysis::DefectKind::missing_run_begin));
  EXPECT_FALSE(late.analysis.report.processes.at(0).complete);
}

// Beside rules and subjects, as in "     S3 S4  11 threads    e.g. ", a screen of 80 columns has 46
// for a reason; what comes behind a semicolon may be cut.
TEST(Ros2Verdicts, ReasonsFitBesideTheirSubjects) {
  const auto expect_fit = [](const Ros2Result& result, std::string_view id) {
    ASSERT_EQ(result.verdict(id), Verdict::inconclusive) << id;
    const auto& rules = result.analysis.verdicts.rules;
    const auto rule = std::ranges::find(rules, id, &analysis::RuleVerdict::id);
    for (const auto& subject : rule->subjects) {
      for (const auto& reason : subject.evidence) {
        const auto note = viewer_export::sentence(reason.note);
        EXPECT_LE(note.substr(0, note.find(';')).size(), 46U) << note;
      }
    }
  };
  const auto unknown = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  for (const auto* id : {"R1", "S3", "S4", "T4"})
    expect_fit(unknown, id);
  timers::Text busy;  // with another timer, while expiries pass
  busy.add_other_timer();
  busy.add(timers::expiry(1) - timers::kMs, "callback_start callback=0x31");
  busy.add(timers::expiry(3) + 80 * timers::kUs, "callback_end callback=0x31");
  busy.run_next(timers::expiry(3) + 100 * timers::kUs);
  expect_fit(busy.analyze(), "R2");
}

// That it exited the kernel tells; whether it crashed, nobody does.
TEST(Ros2Verdicts, HowAProcessEndedIsNotTold) {
  const auto open = analyze_ros2(std::string(kTwoTimers) + kIsolated);
  EXPECT_EQ(open.verdict("T4"), Verdict::inconclusive);
  EXPECT_THAT(open.evidence("T4"), HasSubstr("no event of ROS 2 tells its end"));
  const auto seen =
      analyze_ros2(std::string(kTwoTimers) + kIsolated + "\n  30 sched:sched_process_exit tid=1");
  EXPECT_EQ(seen.verdict("T4"), Verdict::inconclusive);
  EXPECT_THAT(seen.evidence("T4"), HasSubstr("exited, after an orderly end or a crash"));
  for (const auto* names : {"tid=1 old_tid=1", "pid=1 old_pid=1"}) {
    const auto executed = analyze_ros2(std::string(kTwoTimers) + kIsolated +
                                       "\n  30 sched:sched_process_exec " + names);
    EXPECT_EQ(executed.verdict("T4"), Verdict::inconclusive);
    EXPECT_THAT(executed.evidence("T4"), HasSubstr("the process executed another program here"));
    EXPECT_THAT(executed.evidence("T4"), Not(HasSubstr("run_end"))) << "ROS 2 tells none";
  }
}

}  // namespace
}  // namespace cie::test
