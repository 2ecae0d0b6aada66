// S1 to S4, M6 and M9 of recordings that read no parameters back: by sched_switch.
#include "ros2_text.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kSpec =
    "callback_groups:\n"
    "  - id: /n@Timer(1)\n"
    "    affinity: [0, 1]\n"
    "    policy: SCHED_FIFO\n"
    "    priority: 20\n";

Ros2Result judged_by(const std::string& events, const std::string& spec = kSpec) {
  return analyze_ros2(kTwoTimers + events, -1, spec);
}

TEST(SwitchedParameters, PassAsSampledWhenTheyAreAsSpecified) {
  const auto result = judged_by(instance(10, 79) + instance(20, 79, 1));
  EXPECT_EQ(result.verdict("S1"), Verdict::pass);
  EXPECT_THAT(result.evidence("S1"), HasSubstr("sampled"));
  EXPECT_EQ(result.verdict("S2"), Verdict::pass);
}

TEST(SwitchedParameters, FailWithTheLastPrioritySeen) {
  const auto result = judged_by(instance(10, 79) + instance(20, 120));
  EXPECT_EQ(result.verdict("S1"), Verdict::fail);
  EXPECT_THAT(result.evidence("S1"),
              HasSubstr("spec.yaml:2 asks for SCHED_FIFO 20 on CPUs 0,1; the "
                        "kernel schedules thread 7 with nice 0"));
}

std::string spec_with(const std::string& policy) {
  return "callback_groups:\n  - id: /n@Timer(1)\n    policy: " + policy + "\n    nice: 0\n";
}

// SCHED_IDLE keeps the nice value that its process was started with: 120 + 5 here (nice -n 5 chrt -i 0).
TEST(SwitchedParameters, OfTheIdlePolicyMayHaveAnyNiceValue) {
  const std::string idle = "callback_groups:\n  - id: /n@Timer(1)\n    policy: SCHED_IDLE\n";
  for (const int prio : {120, 125}) {
    const auto result = judged_by(instance(10, prio) + instance(20, prio), idle);
    for (const auto* rule : {"S1", "S2"}) {
      EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule << ' ' << prio;
      EXPECT_THAT(result.evidence(rule), HasSubstr("SCHED_OTHER, SCHED_BATCH and SCHED_IDLE apart"))
          << rule << ' ' << prio;
    }
  }
  const auto reniced = judged_by(instance(10, 125) + instance(20, 120), idle);
  EXPECT_EQ(reniced.verdict("S3"), Verdict::inconclusive);
  const auto raised = judged_by(instance(10, 120) + instance(20, 79), idle);
  EXPECT_EQ(raised.verdict("S1"), Verdict::fail);
  EXPECT_EQ(raised.verdict("S3"), Verdict::fail);
}

// Whom nobody configured has that priority, too.
TEST(SwitchedParameters, DoNotTellTheBatchPolicyFromTheUsualOne) {
  const auto events = instance(10, 120) + instance(20, 120);
  EXPECT_EQ(judged_by(events, spec_with("SCHED_BATCH")).verdict("S1"), Verdict::inconclusive);
  const auto other = judged_by(events, spec_with("SCHED_OTHER"));
  EXPECT_EQ(other.verdict("S1"), Verdict::pass);
  EXPECT_THAT(other.evidence("S1"), HasSubstr("OTHER, BATCH and IDLE another"));
  const auto reniced = judged_by(instance(10, 120) + instance(20, 125), spec_with("SCHED_BATCH"));
  EXPECT_EQ(reniced.verdict("S1"), Verdict::fail);
}

TEST(SwitchedParameters, AreJudgedByTheLastPriorityHoweverOftenItChanged) {
  constexpr int kChanges = 1'500;
  for (const bool is_first_good : {false, true}) {
    std::string events;
    for (int i = 0; i < kChanges; ++i)
      events += instance(10 * i + 10, (i % 2 == 0) == is_first_good ? 79 : 120);
    const auto good_at_last = judged_by(events + instance(20'000, 79) + instance(20'010, 79, 1));
    EXPECT_EQ(good_at_last.verdict("S1"), Verdict::pass);
    const auto bad_at_last = judged_by(events + instance(20'000, 120));
    EXPECT_EQ(bad_at_last.verdict("S1"), Verdict::fail);
    const auto on_a_wrong_cpu =
        judged_by(events + instance(19'990, 79, 3) + instance(20'000, 120) + instance(20'010, 79));
    EXPECT_EQ(on_a_wrong_cpu.verdict("S4"), Verdict::fail);
  }
}

TEST(SwitchedParameters, FailOnACpuThatIsNotSpecified) {
  const auto result = judged_by(instance(10, 79) + instance(20, 79, 3));
  EXPECT_EQ(result.verdict("S1"), Verdict::fail);
  EXPECT_THAT(result.evidence("S1"), HasSubstr("the thread ran on CPU 3"));
}

TEST(SwitchedParameters, CountTheCpuThatTheFirstInstanceBeganOn) {
  const auto result = judged_by(instance(10, 79, 3) + instance(20, 79));
  EXPECT_EQ(result.verdict("S4"), Verdict::fail);
  EXPECT_THAT(result.evidence("S4"), HasSubstr("the thread ran on CPU 3"));
}

// A thread is born on whatever CPU, and given its own before its first instance.
TEST(SwitchedParameters, DoNotCountCpusOfBeforeTheFirstInstance) {
  const auto born =
      "\n5 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=79 cpu=3"
      "\n6 sched:sched_switch prev_tid=7 prev_state=0 next_tid=0 next_prio=120 prev_prio=79 cpu=3";
  const auto result = judged_by(born + instance(10, 79) + instance(20, 79));
  EXPECT_EQ(result.verdict("S1"), Verdict::pass);
  EXPECT_EQ(result.verdict("S4"), Verdict::pass);
}

// Whose tid is given to a thread of somebody else once it has left its CPU for good.
TEST(SwitchedParameters, AreNotThoseOfAStrangerThatGotItsTid) {
  const std::string last =
      "\n20 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=79";
  const std::string dead =
      "\n22 sched:sched_switch prev_tid=7 prev_state=16 next_tid=0 next_prio=120 prev_prio=79";
  const std::string stranger =
      "\n30 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=120 cpu=3"
      "\n31 sched:sched_switch prev_tid=7 prev_state=1 next_tid=0 next_prio=120 prev_prio=120 cpu=3";
  for (const std::string exit : {"", "\n21 sched:sched_process_exit tid=7"}) {
    const auto result = judged_by(instance(10, 79) + last + exit + dead + stranger);
    for (const auto* rule : {"S1", "S3", "S4"})
      EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule << exit << result.evidence(rule);
    const auto& threads = result.analysis.report.threads;
    const auto thread = std::ranges::find(threads, 7, &analysis::ThreadReport::tid);
    ASSERT_NE(thread, threads.end());
    EXPECT_EQ(thread->busy_ns, 5) << "3 around its instance, 2 at its end";
  }
}

// A configurator reaches the thread after it began, on whatever CPU it was.
TEST(SwitchedParameters, CountCpusFromTheLastPriorityOn) {
  EXPECT_EQ(judged_by(instance(10, 120, 3) + instance(20, 79)).verdict("S1"), Verdict::pass);
}

TEST(SwitchedParameters, AreInconclusiveWithoutKernelEvents) {
  const auto result =
      judged_by("\n10 callback_start callback=0x30 tid=7\n11 callback_end callback=0x30 tid=7");
  EXPECT_EQ(result.verdict("S1"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("S1"), HasSubstr("no read-back and no switch"));
}

TEST(SwitchedParameters, AreInconclusiveAboutWhatNoSwitchTells) {
  const auto result = judged_by(instance(10, -1),
                                "callback_groups:\n"
                                "  - id: /n@Timer(1)\n"
                                "    policy: SCHED_DEADLINE\n"
                                "    runtime: 2000\n"
                                "    deadline: 4000\n"
                                "    period: 4000\n");
  EXPECT_EQ(result.verdict("S1"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("S1"), HasSubstr("runtime, deadline and period"));
}

// An inherited priority is not the thread's own.
TEST(SwitchedParameters, LeaveInheritedPrioritiesAside) {
  const auto result =
      judged_by(instance(10, 79) + "\n20 sched:sched_pi_setprio tid=7 oldprio=79 newprio=9" +
                instance(21, 9) + "\n30 sched:sched_pi_setprio tid=7 oldprio=9 newprio=79");
  EXPECT_EQ(result.verdict("S1"), Verdict::pass);
}

// The thread's first event is that of its first instance: before, the kernel's alone tell of it.
TEST(SwitchedParameters, LeavePrioritiesAsideThatWereInheritedBeforeTheFirstEvent) {
  const std::string own =
      "\n3 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=89"
      "\n4 sched:sched_switch prev_tid=7 prev_prio=89 prev_state=1 next_tid=0 next_prio=120";
  const auto inherited = "\n5 sched:sched_pi_setprio tid=7 oldprio=89 newprio=79" +
                         instance(10, 79) + instance(20, 79);
  const auto ended = "\n30 sched:sched_pi_setprio tid=7 oldprio=79 newprio=89" + instance(31, 89);
  const std::string fifo_10 =
      "callback_groups:\n  - id: /n@Timer(1)\n    policy: SCHED_FIFO\n    priority: 10\n";
  EXPECT_EQ(judged_by(own + inherited).verdict("S1"), Verdict::fail) << "FIFO 20 is asked for";
  EXPECT_EQ(judged_by(own + inherited).verdict("S2"), Verdict::not_applicable);
  for (const auto* rule : {"S1", "S2", "S3"}) {
    EXPECT_EQ(judged_by(own + inherited, fifo_10).verdict(rule), Verdict::pass) << rule;
    EXPECT_EQ(judged_by(own + inherited + ended, fifo_10).verdict(rule), Verdict::pass) << rule;
  }
  for (const auto* rule : {"S1", "S3"}) {
    const auto unseen = judged_by(inherited);
    EXPECT_EQ(unseen.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(unseen.evidence(rule), HasSubstr("inherited priorities alone")) << rule;
  }
}

// Who has the tid of a thread that ended while it was waited for inherits nothing from that.
TEST(SwitchedParameters, AreNotInheritedByTheNextThreadWithTheTid) {
  const auto ended =
      "\n3 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=120"
      "\n5 sched:sched_pi_setprio tid=7 oldprio=120 newprio=9"
      "\n6 sched:sched_switch prev_tid=7 prev_prio=9 prev_state=16 next_tid=0 next_prio=120";
  const auto result = judged_by(ended + instance(10, 79) + instance(20, 79));
  for (const auto* rule : {"S1", "S2", "S3"})
    EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule;
}

// A hole may hide who began to wait for a mutex of the thread, also before it sleeps with that.
TEST(SwitchedParameters, ThatAreRaisedMayBeInheritedSinceAHole) {
  const auto asked = spec_with("SCHED_OTHER");
  EXPECT_EQ(judged_by(instance(10, 79) + instance(20, 79), asked).verdict("S1"), Verdict::fail);
  const auto result = judged_by(instance(10, 79) + "\n15 kernel_lost 17" + instance(20, 79), asked);
  EXPECT_EQ(result.verdict("S1"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("S1"), HasSubstr("the priority may be inherited since then"));
}

TEST(SwitchedParameters, AreShownWhereNothingWasReadBack) {
  const auto switched = [](const std::string& events) {
    const auto result = judged_by(events, {});
    const auto& threads = result.analysis.report.threads;
    const auto thread = std::ranges::find(threads, 7, &analysis::ThreadReport::tid);
    return thread == threads.end() ? std::nullopt : thread->switched;
  };
  const auto kept = switched(instance(10, 79) + instance(20, 79));
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->prio, 79);
  EXPECT_EQ(kept->text, "real-time priority 20");
  EXPECT_EQ(kept->changes, 0U);
  const auto changed = switched(instance(10, 120) + instance(20, 125));
  ASSERT_TRUE(changed);
  EXPECT_EQ(changed->text, "nice 5");
  EXPECT_EQ(changed->changes, 1U);
  EXPECT_FALSE(switched(unswitched_instance(10)));
}

TEST(SwitchedParameters, FailWhenTheyComeAfterTheFirstInstance) {
  const auto result = judged_by(instance(10, 120) + instance(20, 120) + instance(30, 79));
  EXPECT_EQ(result.verdict("S1"), Verdict::pass);
  EXPECT_EQ(result.verdict("S2"), Verdict::fail);
  EXPECT_THAT(result.evidence("S2"), HasSubstr("started unconfigured; 2 instances did"));
}

// Between the switch-in with the old priority and the switch-out with the new one lies the start.
TEST(SwitchedParameters, AreInconclusiveWhenTheyChangeAroundTheFirstStart) {
  const auto result = judged_by(
      "\n10 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=120"
      "\n11 callback_start callback=0x30 tid=7\n12 callback_end callback=0x30 tid=7"
      "\n13 sched:sched_switch prev_tid=7 prev_prio=79 prev_state=1 next_tid=0 next_prio=120");
  EXPECT_EQ(result.verdict("S1"), Verdict::pass);
  EXPECT_EQ(result.verdict("S2"), Verdict::inconclusive);
}

TEST(SwitchedParameters, AreUnchangedWhereEverySwitchHasThem) {
  const auto result = judged_by(instance(10, 79) + instance(20, 79, 1), {});
  EXPECT_EQ(result.verdict("S3"), Verdict::pass);
  EXPECT_THAT(result.evidence("S3"), HasSubstr("sampled: by the priority of its switches: it had "
                                               "real-time priority 20 throughout"));
}

TEST(SwitchedParameters, MayChangeBeforeTheFirstInstance) {
  const auto result = judged_by(
      "\n5 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=120"
      "\n6 rclcpp_callback_register tid=7 callback=0x30 symbol=f"
      "\n7 sched:sched_switch prev_tid=7 prev_prio=120 prev_state=1 next_tid=0 next_prio=120" +
          instance(10, 79) + instance(20, 79),
      {});
  EXPECT_EQ(result.verdict("S3"), Verdict::pass);
}

TEST(SwitchedParameters, ThatChangeLaterMayBeMeantToUnlessASpecSaysOtherwise) {
  const auto events = instance(10, 79) + instance(20, 120);
  const auto unspecified = judged_by(events, {});
  EXPECT_EQ(unspecified.verdict("S3"), Verdict::inconclusive);
  EXPECT_THAT(unspecified.evidence("S3"), HasSubstr("whether that was meant is unknown"));
  const auto specified = judged_by(events);
  EXPECT_EQ(specified.verdict("S3"), Verdict::fail);
  EXPECT_THAT(specified.evidence("S3"),
              AllOf(HasSubstr("scheduled with real-time priority 20, as spec.yaml:2 asks for"),
                    HasSubstr("from here on with nice 0")));
}

TEST(SwitchedParameters, MayBecomeTheSpecsLate) {
  EXPECT_EQ(judged_by(instance(10, 120) + instance(20, 79)).verdict("S3"), Verdict::pass);
}

TEST(SwitchedParameters, AreUnchangedThroughInheritance) {
  const auto result =
      judged_by(instance(10, 79) + "\n20 sched:sched_pi_setprio tid=7 oldprio=79 newprio=9" +
                instance(21, 9) + "\n30 sched:sched_pi_setprio tid=7 oldprio=9 newprio=79");
  EXPECT_EQ(result.verdict("S3"), Verdict::pass);
}

// LTTng tells a priority that goes on when the last waiter is gone.
TEST(SwitchedParameters, ThatChangeAfterInheritanceAreNotInherited) {
  const auto judged = [](const std::string& lines) {
    return judged_by(instance(10, 79) + "\n20 sched:sched_pi_setprio tid=7 oldprio=79 newprio=9" +
                     instance(21, 9) + "\n30 sched:sched_pi_setprio tid=7 oldprio=9 newprio=9" +
                     lines);
  };
  EXPECT_EQ(judged(instance(31, 79)).verdict("S3"), Verdict::pass);
  for (const int prio : {9, 120}) {
    const auto result = judged(instance(31, 79) + instance(40, prio));
    for (const auto* rule : {"S1", "S3"})
      EXPECT_EQ(result.verdict(rule), Verdict::fail) << rule << ' ' << prio;
  }
}

// Each change of what is inherited is told: who runs with another raised priority has that of its own.
TEST(SwitchedParameters, ThatChangeDuringInheritanceAreNotInherited) {
  const auto boosted = instance(10, 79) +
                       "\n20 sched:sched_pi_setprio tid=7 oldprio=79 newprio=49" + instance(21, 49);
  const std::string ended = "\n30 sched:sched_pi_setprio tid=7 oldprio=49 newprio=49";
  for (const auto& before : {boosted, boosted + ended}) {
    EXPECT_EQ(judged_by(before + instance(31, 49)).verdict("S3"), Verdict::pass) << before;
    for (const int prio : {59, 39}) {
      const auto result = judged_by(before + instance(31, prio) + instance(40, prio));
      for (const auto* rule : {"S1", "S3"})
        EXPECT_EQ(result.verdict(rule), Verdict::fail) << rule << ' ' << prio << before;
    }
  }
}

// As in LTTng's recordings. What ended before the window excuses nothing within.
TEST(SwitchedParameters, ThatChangeInAWindowWereNotInheritedBeforeIt) {
  const auto events = kTwoTimers + instance(10, 79) +
                      "\n15 sched:sched_pi_setprio tid=7 oldprio=79 newprio=9" + instance(16, 9) +
                      "\n25 sched:sched_pi_setprio tid=7 oldprio=9 newprio=9" + instance(26, 79) +
                      instance(40, 9);
  for (const auto* rule : {"S1", "S3"}) {
    EXPECT_EQ(analyze_ros2(events, -1, kSpec).verdict(rule), Verdict::fail) << rule;
    const analysis::TimeWindow window{.from = {35}, .to = {60}};
    EXPECT_EQ(analyze_ros2(events, -1, kSpec, window).verdict(rule), Verdict::fail) << rule;
  }
}

// What it was last seen with before the window is its own where all within is inherited.
TEST(SwitchedParameters, OfAWindowAreThoseBeforeItWhereAllWithinAreInherited) {
  const auto events = kTwoTimers + instance(10, 79) + instance(20, 120) +
                      "\n25 sched:sched_pi_setprio tid=7 oldprio=120 newprio=79" + instance(40, 79);
  EXPECT_EQ(analyze_ros2(events, -1, kSpec).verdict("S1"), Verdict::fail);
  const analysis::TimeWindow window{.from = {35}, .to = {60}};
  EXPECT_EQ(analyze_ros2(events, -1, kSpec, window).verdict("S1"), Verdict::fail);
}

constexpr const char* kUnscheduled =
    "\n10 callback_start callback=0x30 tid=7\n11 callback_end callback=0x30 tid=7";

TEST(SwitchedParameters, AreUnknownWithoutSwitches) {
  const auto result = judged_by(kUnscheduled, {});
  for (const auto* rule : {"S3", "S4"}) {
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(result.evidence(rule), HasSubstr("record kernel events")) << rule;
  }
}

TEST(SwitchedParameters, CpusAreJudgedByTheSpecs) {
  const auto inside = judged_by(instance(10, 79) + instance(20, 79, 1));
  EXPECT_EQ(inside.verdict("S4"), Verdict::pass);
  EXPECT_THAT(inside.evidence("S4"), HasSubstr("nobody read back what the kernel allows"));
  const auto outside = judged_by(instance(10, 79) + instance(20, 79, 3));
  EXPECT_EQ(outside.verdict("S4"), Verdict::fail);
  EXPECT_THAT(outside.evidence("S4"), HasSubstr("the thread ran on CPU 3"));
}

TEST(SwitchedParameters, WithoutTheSpecsCpusThoseUsedAreTold) {
  const auto result = judged_by(instance(10, 79) + instance(20, 79, 3), {});
  EXPECT_EQ(result.verdict("S4"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("S4"),
              HasSubstr("no read-back of the allowed CPUs; its switches show it on CPUs 0,3"));
}

TEST(SwitchedParameters, SayWhatIsKnownOfAThreadThatNobodyAnnounced) {
  const auto result = judged_by(instance(10, 79) + instance(20, 79, 1), {});
  EXPECT_EQ(result.verdict("M9"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M9"),
              HasSubstr("the kernel schedules it with real-time priority 20 on "
                        "CPUs 0,1; no event tells whose it is"));
}

// Switched out at 13; on a CPU from 20 to 23, of which 1 ns in its callback; the recording ends at 24.
TEST(SwitchedParameters, WorkOutsideCallbacksIsJudgedByTheSpecsBudget) {
  const auto with_budget = [](int budget) {
    return judged_by(
        instance(10, 79) + "\n19 sched:sched_waking tid=7 prio=79 target_cpu=0" + instance(20, 79),
        "callback_groups:\n  - id: /n@Timer(1)\n    foreign_work_budget: " +
            std::to_string(budget) + "\n");
  };
  // 2 ns in 11 ns are 181 818 181.8 ns in a second.
  EXPECT_EQ(with_budget(181'818'182).verdict("M6"), Verdict::pass)
      << with_budget(181'818'182).evidence("M6");
  EXPECT_EQ(with_budget(181'818'181).verdict("M6"), Verdict::fail);
}

// It is switched out for the last time when it has exited: no wait, after which work would be foreign.
TEST(SwitchedParameters, AThreadThatNeverWaitedHasNoTimeForWorkOutsideCallbacks) {
  const auto result = judged_by(
      "\n10 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=79 cpu=0"
      "\n11 callback_start callback=0x30 tid=7 cpu=0\n12 callback_end callback=0x30 tid=7 cpu=0"
      "\n13 sched:sched_process_exit tid=7 cpu=0"
      "\n14 sched:sched_switch prev_tid=7 prev_state=128 next_tid=0 next_prio=120 prev_prio=79 cpu=0",
      "callback_groups:\n  - id: /n@Timer(1)\n    foreign_work_budget: 1\n");
  EXPECT_EQ(result.verdict("M6"), Verdict::inconclusive);
}

TEST(SwitchedParameters, WorkOutsideCallbacksOfASharedThreadIsNobodys) {
  const auto result =
      judged_by(instance(10, 79) + instance(20, 79) +
                    "\n30 callback_start callback=0x31 tid=7"
                    "\n31 callback_end callback=0x31 tid=7",
                "callback_groups:\n  - id: /n@Timer(1)\n    foreign_work_budget: 1\n");
  EXPECT_EQ(result.verdict("M6"), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
