// S1 to S4 of recordings that read no parameters back, where the kernel's record is not whole.
#include "ros2_text.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::TimeWindow;
using analysis::Verdict;
using testing::HasSubstr;

// SCHED_FIFO 20 is the kernel's priority 79.
constexpr const char* kFifo20 =
    "callback_groups:\n"
    "  - id: /n@Timer(1)\n"
    "    affinity: [0, 1]\n"
    "    policy: SCHED_FIFO\n"
    "    priority: 20\n";
constexpr const char* kCpusAlone = "callback_groups:\n  - id: /n@Timer(1)\n    affinity: [0, 1]\n";
// Somebody else runs on CPU 3, which so has a record.
const std::string kOnCpu3 =
    "\n3 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=9 next_prio=120 cpu=3"
    "\n4 sched:sched_switch prev_tid=9 prev_prio=120 prev_state=1 next_tid=0 next_prio=120 cpu=3";

Ros2Result judged_partly(const std::string& events, const std::string& spec = kFifo20) {
  return analyze_ros2(kTwoTimers + events, -1, spec);
}

// Of a window behind the first instance nobody can tell how that began.
TEST(BeforeTheFirstInstance, IsNotAskedForWhereThatLiesBeforeTheWindow) {
  const TimeWindow later{.from = {15}, .to = {40}};
  const TimeWindow whole{.from = {5}, .to = {40}};
  const auto good = kTwoTimers + instance(10, 79) + instance(20, 120) + instance(30, 79);
  EXPECT_EQ(analyze_ros2(good, -1, kFifo20).verdict("S2"), Verdict::pass);
  EXPECT_EQ(analyze_ros2(good, -1, kFifo20, later).verdict("S2"), Verdict::not_applicable);
  const auto bad = kTwoTimers + instance(10, 120) + instance(20, 79) + instance(30, 79);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20).verdict("S2"), Verdict::fail);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20, later).verdict("S2"), Verdict::not_applicable);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20, whole).verdict("S2"), Verdict::fail);
}

// It was configured before, perhaps, and had changed when its next switch was seen.
TEST(BeforeTheFirstInstance, IsUnknownWithoutASwitchThere) {
  const auto later = instance(20, 120) + instance(30, 79);
  for (const auto* record : {"\n8 kernel_lost 15", "\n8 kernel_begins"}) {
    const bool is_late = std::string(record).ends_with("begins");
    const auto result = judged_partly(is_late ? unswitched_instance(5) + record + later
                                              : record + unswitched_instance(10) + later);
    EXPECT_EQ(result.verdict("S2"), Verdict::inconclusive) << record;
    EXPECT_THAT(result.evidence("S2"), HasSubstr("its priority before is unknown")) << record;
  }
}

TEST(BeforeTheFirstInstance, IsKnownWhateverIsLostLater) {
  const auto unconfigured = instance(10, 120) + "\n15 kernel_lost 16" + instance(20, 79);
  EXPECT_EQ(judged_partly(unconfigured).verdict("S2"), Verdict::fail);
  const auto configured = instance(10, 79) + "\n15 kernel_lost 16" + instance(20, 79);
  EXPECT_EQ(judged_partly(configured).verdict("S2"), Verdict::pass);
}

TEST(BeforeTheFirstInstance, MayHaveHadThePriorityThatWasSeenNowhere) {
  EXPECT_EQ(judged_partly(instance(10, 120) + instance(20, 120)).verdict("S2"),
            Verdict::not_applicable);
  EXPECT_EQ(
      judged_partly(instance(10, 120) + "\n15 kernel_lost 16" + instance(20, 120)).verdict("S2"),
      Verdict::inconclusive);
}

// Real-time priority 90 (9), where 20 is asked for.
TEST(BeforeTheFirstInstance, MayHaveHadAHigherPriorityByInheritance) {
  const auto lost = [](const std::string& hole) {
    return judged_partly(instance(10, 9) + hole + instance(20, 79)).verdict("S2");
  };
  EXPECT_EQ(lost(""), Verdict::fail);
  EXPECT_EQ(lost("\n12 kernel_lost 19"), Verdict::inconclusive);
}

TEST(PartOfTheRun, PassesNothingThatTheRestMayViolate) {
  const auto whole = instance(10, 79) + instance(20, 79) + instance(30, 79);
  const auto early = instance(10, 79) + instance(20, 79) + "\n25 kernel_ends";
  const auto late = "\n15 kernel_begins" + instance(20, 79) + instance(30, 79);
  for (const auto* rule : {"S1", "S3", "S4"}) {
    EXPECT_EQ(judged_partly(whole).verdict(rule), Verdict::pass) << rule;
    const auto ended = judged_partly(early + unswitched_instance(30));
    EXPECT_EQ(ended.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(ended.evidence(rule), HasSubstr("the kernel's record ends here")) << rule;
    const auto begun = judged_partly(unswitched_instance(10) + late);
    EXPECT_EQ(begun.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(begun.evidence(rule), HasSubstr("the kernel's record begins here")) << rule;
    EXPECT_EQ(judged_partly(early).verdict(rule), Verdict::pass) << rule << ": it ran no more";
    EXPECT_EQ(judged_partly(late).verdict(rule), Verdict::pass) << rule << ": it had not run";
  }
}

// As the evidence advises. Of the first instance, what lies before the window is not known.
TEST(PartOfTheRun, IsJudgedInAWindowOfItsOwn) {
  const auto early = instance(10, 79) + instance(20, 79) + "\n25 kernel_ends";
  const auto late = "\n15 kernel_begins" + instance(20, 79) + instance(30, 79);
  const auto in_window = [](const std::string& events, const TimeWindow& window) {
    return analyze_ros2(kTwoTimers + events, -1, kFifo20, window);
  };
  const auto& [from, to] = TimeWindow{};
  for (const auto* rule : {"S1", "S3", "S4"}) {
    const auto ended = early + unswitched_instance(30);
    EXPECT_THAT(judged_partly(ended).evidence(rule), HasSubstr("--window ..25 judges")) << rule;
    EXPECT_EQ(in_window(ended, {.from = from, .to = {25}}).verdict(rule), Verdict::pass) << rule;
    const auto begun = unswitched_instance(10) + late;
    EXPECT_THAT(judged_partly(begun).evidence(rule), HasSubstr("--window 15.. judges")) << rule;
    EXPECT_EQ(in_window(begun, {.from = {15}, .to = to}).verdict(rule), Verdict::pass) << rule;
  }
}

TEST(PartOfTheRun, FailsWhatItShowsButForTheLastConfiguration) {
  const auto early = instance(10, 79) + instance(20, 120, 3) + "\n25 kernel_ends";
  EXPECT_EQ(judged_partly(early).verdict("S1"), Verdict::fail);
  const auto result = judged_partly(early + unswitched_instance(30));
  for (const auto* rule : {"S3", "S4"})
    EXPECT_EQ(result.verdict(rule), Verdict::fail) << rule;
  EXPECT_EQ(result.verdict("S1"), Verdict::inconclusive) << "it may have been configured anew";
  const auto lost = instance(10, 79) + instance(20, 120) + "\n25 kernel_lost 35";
  EXPECT_EQ(judged_partly(lost + unswitched_instance(30)).verdict("S1"), Verdict::inconclusive);
  EXPECT_EQ(judged_partly("\n5 kernel_lost 7" + instance(20, 120)).verdict("S1"), Verdict::fail);
}

TEST(PartOfTheRun, MayLackThePriorityThatWasSeenNowhere) {
  const auto early = instance(10, 120) + "\n15 kernel_ends" + unswitched_instance(20);
  EXPECT_EQ(judged_partly(early).verdict("S2"), Verdict::inconclusive);
}

// Its own events show it on a CPU of which the kernel recorded nothing.
TEST(CpusOfStartsAndEnds, FailWhereNoSwitchShowsThem) {
  const auto stays = instance(10, 79) + instance(20, 79);
  EXPECT_EQ(judged_partly(stays, kCpusAlone).verdict("S4"), Verdict::pass);
  const auto strays = instance(10, 79) + unswitched_instance(20, 3) + instance(30, 79);
  for (const auto* spec : {kFifo20, kCpusAlone}) {
    const auto result = judged_partly(strays, spec);
    EXPECT_EQ(result.verdict("S4"), Verdict::fail) << spec;
    EXPECT_THAT(result.evidence("S4"), HasSubstr("cpu: spec.yaml:2 asks for")) << spec;
    EXPECT_THAT(result.evidence("S4"), HasSubstr("the thread ran on CPU 3")) << spec;
    EXPECT_EQ(result.verdict("S1"), Verdict::inconclusive) << spec;
  }
}

// An instance may start on one CPU and end on another.
TEST(CpusOfStartsAndEnds, AreAllOfThem) {
  const auto moved = instance(10, 79) +
                     "\n21 callback_start callback=0x30 tid=7 cpu=3"
                     "\n22 callback_end callback=0x30 tid=7 cpu=1" +
                     instance(30, 79, 1);
  EXPECT_EQ(judged_partly(moved).verdict("S4"), Verdict::fail);
}

TEST(CpusOfStartsAndEnds, FailWithoutKernelEventsUnlessItMayHaveBeenGivenThemLater) {
  const auto events = unswitched_instance(10, 3) + unswitched_instance(20);
  EXPECT_EQ(judged_partly(events, kCpusAlone).verdict("S4"), Verdict::fail);
  EXPECT_EQ(judged_partly(unswitched_instance(10, 3) + instance(20, 79), kCpusAlone).verdict("S4"),
            Verdict::fail)
      << "its first switch was seen later";
  EXPECT_EQ(judged_partly(events).verdict("S4"), Verdict::inconclusive);
  EXPECT_EQ(judged_partly(instance(10, 120, 3) + instance(20, 79)).verdict("S4"), Verdict::pass)
      << "the spec's priority and its CPUs were given to it between the two";
}

// The switch in which the spec's priority would have been seen first is lost.
TEST(CpusOfStartsAndEnds, AreNotJudgedFromAPriorityThatWasSeenTooLate) {
  const auto given_late = [](const std::string& hole) {
    return judged_partly(kOnCpu3 + unswitched_instance(10, 3) + hole + instance(20, 79))
        .verdict("S4");
  };
  EXPECT_EQ(given_late("\n13 kernel_lost 15"), Verdict::inconclusive);
  const auto never_seen = instance(10, 120, 3) + "\n15 kernel_lost 17" + instance(20, 120);
  EXPECT_EQ(judged_partly(never_seen).verdict("S4"), Verdict::inconclusive);
}

TEST(CpusOfStartsAndEnds, FailTheLastConfigurationIfNothingIsLostSince) {
  const auto strays = [](const std::string& lines) {
    return judged_partly(kOnCpu3 + instance(10, 79) + lines).verdict("S1");
  };
  EXPECT_EQ(strays("\n18 kernel_lost 20" + unswitched_instance(20, 3)), Verdict::fail);
  EXPECT_EQ(strays("\n18 kernel_lost 23" + unswitched_instance(20, 3)), Verdict::inconclusive)
      << "it may have been configured anew at its end";
}

// As after `lttng enable-event --kernel sched_switch`: who inherits a priority is not told.
TEST(AHigherPriority, IsNoWitnessWhereInheritanceIsNotRecorded) {
  const std::string untold = "\n0 kernel_without_inheritance";
  const auto raised = instance(10, 79) + instance(20, 9);
  for (const auto* rule : {"S1", "S3"}) {
    EXPECT_EQ(judged_partly(raised).verdict(rule), Verdict::fail) << rule;
    const auto result = judged_partly(untold + raised);
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(result.evidence(rule), HasSubstr("sched_pi_setprio was not recorded")) << rule;
  }
  const auto at_first = instance(10, 9) + instance(20, 79);
  EXPECT_EQ(judged_partly(at_first).verdict("S2"), Verdict::fail);
  EXPECT_EQ(judged_partly(untold + at_first).verdict("S2"), Verdict::inconclusive);
}

TEST(ALowerPriority, IsAWitnessWhereInheritanceIsNotRecorded) {
  const auto lowered =
      judged_partly("\n0 kernel_without_inheritance" + instance(10, 79) + instance(20, 120));
  EXPECT_EQ(lowered.verdict("S1"), Verdict::fail);
  EXPECT_EQ(lowered.verdict("S3"), Verdict::fail);
  const auto sound =
      judged_partly("\n0 kernel_without_inheritance" + instance(10, 79) + instance(20, 79));
  EXPECT_EQ(sound.verdict("S1"), Verdict::pass);
  EXPECT_EQ(sound.verdict("S3"), Verdict::pass);
}

// Of what has the tid of its thread behind a hole that may have taken the exit.
std::string stranger(const std::string& prio) {
  return "\n40 sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=" +
         prio +
         " cpu=3\n42 sched:sched_switch prev_tid=7 prev_state=1 next_tid=0 next_prio=120 prev_prio=" +
         prio + " cpu=3";
}

TEST(SwitchesBehindAHole, MayBeOfAnotherThreadWithTheSameTid) {
  const std::string hole = "\n25 kernel_lost 30";
  const auto good = kOnCpu3 + instance(10, 79) + instance(20, 79);
  const auto whole = judged_partly(good + stranger("120"));
  const auto lossy = judged_partly(good + hole + stranger("120"));
  for (const auto* rule : {"S1", "S3", "S4"}) {
    EXPECT_EQ(whole.verdict(rule), Verdict::fail) << rule;
    EXPECT_EQ(lossy.verdict(rule), Verdict::inconclusive) << rule << lossy.evidence(rule);
  }
  const auto alive = judged_partly(good + hole + stranger("120") + instance(50, 120));
  for (const auto* rule : {"S3", "S4"})
    EXPECT_EQ(alive.verdict(rule), Verdict::fail) << rule;
  EXPECT_EQ(judged_partly(good + hole + stranger("120"), kCpusAlone).verdict("S4"),
            Verdict::inconclusive);
}

TEST(SwitchesBehindAHole, ShowNoSpecifiedPriorityOfTheThread) {
  const auto bad = kOnCpu3 + instance(10, 120) + instance(20, 120);
  EXPECT_EQ(judged_partly(bad).verdict("S1"), Verdict::fail);
  EXPECT_EQ(judged_partly(bad).verdict("S2"), Verdict::not_applicable);
  const auto lossy = judged_partly(bad + "\n25 kernel_lost 30" + stranger("79"));
  for (const auto* rule : {"S1", "S2", "S3", "S4"})
    EXPECT_EQ(lossy.verdict(rule), Verdict::inconclusive) << rule << lossy.evidence(rule);
}

// Somebody waited for the thread already, perhaps: no event tells since when.
TEST(AHigherPriority, IsNoWitnessWhereTheKernelsRecordBeganWithIt) {
  const std::string late = "\n8 kernel_begins";
  const auto always = instance(10, 9) + instance(20, 9);
  EXPECT_EQ(judged_partly(always).verdict("S1"), Verdict::fail);
  EXPECT_EQ(judged_partly(late + always).verdict("S1"), Verdict::inconclusive);
  EXPECT_EQ(judged_partly(late + instance(10, 79) + instance(20, 9)).verdict("S1"), Verdict::fail);
  EXPECT_EQ(judged_partly(late + instance(10, 120) + instance(20, 120)).verdict("S1"),
            Verdict::fail)
      << "a lower one";
  const auto at_first = instance(10, 9) + instance(20, 79);
  EXPECT_EQ(judged_partly(at_first).verdict("S2"), Verdict::fail);
  EXPECT_EQ(judged_partly(late + at_first).verdict("S2"), Verdict::inconclusive);
}

// What the kernel returns to is the thread's own priority.
TEST(AHigherPriority, WasInheritedWhereTheKernelTakesItBack) {
  const auto judged = [](int taken_back, int own) {
    return judged_partly("\n8 kernel_begins" + instance(10, 9) +
                         "\n15 sched:sched_pi_setprio tid=7 oldprio=9 newprio=" +
                         std::to_string(taken_back) + instance(20, own));
  };
  for (const auto* rule : {"S1", "S2", "S3"})
    EXPECT_EQ(judged(79, 79).verdict(rule), Verdict::pass) << rule;
  EXPECT_EQ(judged(100, 79).verdict("S2"), Verdict::inconclusive)
      << "LTTng's event tells the priority of who waits still";
  const auto rose =
      judged_partly(instance(10, 79) + instance(20, 9) +
                    "\n25 sched:sched_pi_setprio tid=7 oldprio=9 newprio=79" + instance(30, 79));
  EXPECT_EQ(rose.verdict("S3"), Verdict::pass);
}

}  // namespace
}  // namespace cie::test
