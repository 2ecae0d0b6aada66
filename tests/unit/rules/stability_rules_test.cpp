#include "support/verdicts.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string configured_run(const std::string& lines) {
  return "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=80\n" +
         lines + "\n10 start fusion\n12 end fusion\n20 start fusion\n22 end fusion";
}

TEST(ParametersUnchanged, ComparesAuditsWithWhatWasApplied) {
  EXPECT_EQ(Verified(configured_run("30 audit fusion policy=fifo priority=80"))["S3"],
            Verdict::pass);
  const Verified changed(configured_run("30 audit fusion policy=fifo priority=79"));
  EXPECT_EQ(changed.of("S3", "thread 101"), Verdict::fail);
  EXPECT_THAT(changed.evidence("S3", "thread 101"),
              AllOf(HasSubstr("-90 thread_sched applied: SCHED_FIFO 80"),
                    HasSubstr("30 thread_sched later read back: SCHED_FIFO 79")));
  EXPECT_EQ(Verified(configured_run("25 applied fusion policy=fifo priority=79\n"
                                    "30 audit fusion policy=fifo priority=79"))["S3"],
            Verdict::pass)
      << "the last applied before the audit counts";
}

// Within a nanosecond, events of two CPUs may come in any order.
TEST(ParametersUnchanged, OrdersReadBacksByTheirNumbers) {
  const auto verified = [](const std::string& lines, bool is_swapped, std::string_view spec = {}) {
    auto trace = trace_of(configured_run(lines));
    const auto first =
        std::ranges::find(trace.events, 30, [](const Event& event) { return event.head.time.ns; });
    if (is_swapped) std::iter_swap(first, std::next(first));
    return Verified(trace, spec);
  };
  const std::string applied = "30 applied fusion policy=fifo priority=79\n";
  const std::string as_before = "30 audit fusion policy=fifo priority=80\n";
  const std::string as_applied = "30 audit fusion policy=fifo priority=79\n";
  for (const bool is_swapped : {false, true}) {
    EXPECT_EQ(verified(applied + as_applied, is_swapped)["S3"], Verdict::pass) << is_swapped;
    EXPECT_EQ(verified(as_before + applied, is_swapped)["S3"], Verdict::pass) << is_swapped;
    EXPECT_EQ(verified(as_applied + applied, is_swapped)["S3"], Verdict::fail) << is_swapped;
    const auto changed = verified(applied + as_before, is_swapped);
    EXPECT_EQ(changed["S3"], Verdict::fail) << is_swapped;
    EXPECT_THAT(changed.evidence("S3", "thread 101"),
                HasSubstr("30 thread_sched applied: SCHED_FIFO 79"));
    // S1 judges what was applied last.
    EXPECT_EQ(
        verified("30 applied fusion policy=fifo priority=78\n" + applied, is_swapped,
                 "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 79}\n")["S1"],
        Verdict::pass)
        << is_swapped;
  }
}

// The audit at 15 follows on what was applied. Another one, before 40, was lost: whether what the kernel
// shows at 30 was applied meanwhile is unknown. That takes nothing from the audit (L6).
TEST(ParametersUnchanged, FailsByAnAuditWhateverMayHaveBeenAppliedLater) {
  const auto judged = [](const std::string& kernel) {
    return Verified(
        configured_run("15 audit fusion policy=fifo priority=79\n"
                       "40 audit fusion policy=fifo priority=79 n=4\n" +
                       kernel));
  };
  ASSERT_EQ(judged("")["S3"], Verdict::fail);
  const auto with_kernel = judged("30 switch 0 idle fusion next_prio=49");
  EXPECT_EQ(with_kernel["S3"], Verdict::fail);
  EXPECT_THAT(with_kernel.evidence("S3", "thread 101"),
              AllOf(HasSubstr("15 thread_sched later read back: SCHED_FIFO 79"),
                    Not(HasSubstr("30 sched_switch"))));
}

// Somebody asked for what is not as the thread began; the kernel's own values follow the machine.
TEST(ParametersUnchanged, ComparesSlicesThatWereAskedFor) {
  const auto sliced = [](const char* applied, const char* audit) {
    return Verified(std::string("callback fusion\n-100 initial fusion slice=2800000\n"
                                "-90 applied fusion slice=") +
                    applied +
                    "\n10 start fusion\n12 end fusion\n30 audit fusion slice=" + audit)["S3"];
  };
  EXPECT_EQ(sliced("100000", "100000"), Verdict::pass);
  EXPECT_EQ(sliced("100000", "2800000"), Verdict::fail);
  EXPECT_EQ(sliced("2800000", "3000000"), Verdict::pass);
}

TEST(ParametersUnchanged, ComparesClampsThatTheSpecAsksFor) {
  constexpr auto kClamped = R"(
    callback fusion
    -100 initial fusion util_max=1024
    -90 applied fusion util_max=1024
    10 start fusion
    12 end fusion
    30 audit fusion util_max=512)";
  EXPECT_EQ(
      Verified(kClamped,
               "callback_groups:\n  - {id: fusion, policy: SCHED_OTHER, uclamp_max: 1024}\n")["S3"],
      Verdict::fail);
  EXPECT_EQ(Verified(kClamped, "callback_groups:\n  - {id: fusion, policy: SCHED_OTHER}\n")["S3"],
            Verdict::pass)
      << "the kernel's own";
}

// Its object outlived the thread: whoever had the tid by then was read.
TEST(ParametersUnchanged, TakesNoReadBackAfterTheKernelsExitForTheThreads) {
  const auto verified = [](const std::string& exit) {
    auto trace = trace_of(configured_run("24 audit fusion policy=fifo priority=80\n" + exit +
                                         "\n30 audit fusion policy=fifo priority=33 cpus=1\n"
                                         "31 finish fusion"));
    for (auto& event : trace.events)
      if (event.head.time.ns == 30 || event.head.time.ns == 31) event.head.tid = 100;
    return Verified(trace);
  };
  EXPECT_EQ(verified("25 exit fusion")["S3"], Verdict::pass)
      << verified("25 exit fusion").evidence("S3", "thread 101");
  EXPECT_EQ(verified("")["S3"], Verdict::fail) << "it lived";
}

TEST(ParametersUnchanged, IsNotJudgedWhileParametersChange) {
  EXPECT_EQ(Verified(configured_run("14 audit fusion policy=fifo priority=80 change=1\n"
                                    "15 switch 0 idle fusion next_prio=29\n"
                                    "16 audit fusion policy=fifo priority=70 change=1\n"
                                    "17 applied fusion policy=fifo priority=70 change=1\n"
                                    "18 switch 0 fusion idle prio=29"))["S3"],
            Verdict::pass);
  EXPECT_EQ(Verified(configured_run("14 audit fusion policy=fifo priority=79 change=1\n"
                                    "17 applied fusion policy=fifo priority=70 change=1"))["S3"],
            Verdict::fail)
      << "what it ran as before the change is judged";
  EXPECT_EQ(Verified(configured_run("14 audit fusion policy=fifo priority=80 change=1\n"
                                    "17 applied fusion policy=fifo priority=70 change=1\n"
                                    "18 switch 0 idle fusion next_prio=19"))["S3"],
            Verdict::fail)
      << "and what it runs as after it";
}

TEST(AllowedCpus, AreNotJudgedWhileTheyChange) {
  const auto moved = [](const char* lines) {
    return Verified(std::string("callback fusion\n-100 initial fusion cpus=0\n"
                                "-90 applied fusion cpus=0\n5 start fusion\n6 end fusion\n") +
                    lines +
                    "\n9 start fusion cpu=1\n10 end fusion cpu=1\n"
                    "11 applied fusion cpus=0,1 change=1")
        .of("S4", "thread 101");
  };
  EXPECT_EQ(moved("8 audit fusion cpus=0 change=1"), Verdict::pass);
  EXPECT_EQ(moved("8 audit fusion cpus=0"), Verdict::fail);
}

TEST(ParametersUnchanged, ComparesPrioritiesOfSwitches) {
  // FIFO 80 is kernel priority 19; FIFO 50 is 49.
  EXPECT_EQ(Verified(configured_run("5 switch 0 idle fusion next_prio=19"))["S3"], Verdict::pass);
  const Verified changed(configured_run("5 switch 0 idle fusion next_prio=49"));
  EXPECT_EQ(changed.of("S3", "thread 101"), Verdict::fail);
  EXPECT_THAT(changed.evidence("S3", "thread 101"),
              HasSubstr("5 sched_switch the kernel schedules it with real-time priority 50"));
}

TEST(ParametersUnchanged, ExcusesPriorityInheritance) {
  EXPECT_EQ(
      Verified(configured_run("5 boost fusion prio=9\n6 switch 0 idle fusion next_prio=9\n"
                              "7 boost fusion prio=19\n8 switch 0 fusion idle prio=19"))["S3"],
      Verdict::pass);
}

TEST(ParametersUnchanged, IsInconclusiveWithoutAnythingToCompare) {
  EXPECT_EQ(Verified(configured_run("")).of("S3", "thread 101"), Verdict::inconclusive);
}

TEST(ParametersUnchanged, AppliesNotToThreadsThatWereNeverConfigured) {
  EXPECT_EQ(Verified("thread t1 pool\ncallback a pooled\n1 start a on=t1\n2 end a on=t1")["S3"],
            Verdict::not_applicable);
}

TEST(ParametersUnchanged, IsInconclusiveWhenWhatWasAppliedInBetweenWasLost) {
  auto trace =
      trace_of(configured_run("25 applied fusion policy=fifo priority=79\n"
                              "30 audit fusion policy=fifo priority=79"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 2; });
  EXPECT_EQ(Verified(trace)["S3"], Verdict::inconclusive) << "no false FAIL";
}

TEST(ParametersUnchanged, KeepsItsFailureWhenALaterReadBackWasLost) {
  auto trace =
      trace_of(configured_run("30 audit fusion policy=fifo priority=79\n"
                              "40 audit fusion policy=fifo priority=79"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 3; });
  EXPECT_EQ(Verified(trace)["S3"], Verdict::fail);
}

// Of an attached process the first audit stands for what was applied: it agrees with itself.
TEST(ParametersUnchanged, DoesNotCompareTheFirstAuditOfAnAttachedProcessWithItself) {
  const auto attached = [](const std::string& lines) {
    return Verified("process app attached crash\ncallback fusion\n5 start fusion\n6 end fusion\n" +
                    lines)
        .on("S3", "thread 101");
  };
  EXPECT_EQ(attached("").verdict, Verdict::inconclusive);
  EXPECT_EQ(attached("8 audit fusion").verdict, Verdict::pass);
  EXPECT_EQ(attached("8 audit fusion").checked, 1U);
  EXPECT_EQ(attached("8 audit fusion nice=3").verdict, Verdict::fail);
  EXPECT_EQ(attached("8 switch 0 fusion idle state=1").verdict, Verdict::pass);
  EXPECT_EQ(attached("-1 begin fusion").verdict, Verdict::not_applicable) << "never read back";
}

TEST(ParametersUnchanged, RestsOnReadBacksWhereKernelEventsWereLost) {
  constexpr auto kLoss = "14 discard kernel until=18 count=3";
  const Verified audited(
      configured_run(std::string("30 audit fusion policy=fifo priority=80\n") + kLoss));
  EXPECT_EQ(audited["S3"], Verdict::pass);
  EXPECT_THAT(audited.evidence("S3", "thread 101"), HasSubstr("by read-back"));
  EXPECT_EQ(
      Verified(configured_run(std::string("5 switch 0 idle fusion next_prio=19\n") + kLoss))["S3"],
      Verdict::inconclusive);
}

TEST(ParametersUnchanged, DoesNotTakeAnInheritedPriorityForAChangeWhereItsBoostMayBeLost) {
  const auto judged = [](const char* loss, int prio) {
    return Verified(configured_run("6 switch 0 idle fusion next_prio=" + std::to_string(prio) +
                                   '\n' + loss))["S3"];
  };
  constexpr auto kBefore = "2 discard kernel until=5 count=3\n";
  constexpr auto kAfter = "7 discard kernel until=9 count=3\n";
  const Verified audited(
      configured_run("6 switch 0 idle fusion next_prio=9\n"
                     "30 audit fusion policy=fifo priority=80\n" +
                     std::string(kBefore)));
  EXPECT_EQ(audited["S3"], Verdict::pass);
  EXPECT_THAT(
      audited.evidence("S3", "thread 101"),
      HasSubstr("6 by read-back the kernel schedules it with real-time priority 90, which may be"));
  EXPECT_EQ(judged(kBefore, 9), Verdict::inconclusive) << "more urgent than 19: perhaps inherited";
  EXPECT_EQ(judged(kBefore, 25), Verdict::fail) << "nobody inherits a lower priority";
  EXPECT_EQ(judged(kAfter, 9), Verdict::fail);
}

// sched_setattr() on the owner of a mutex that a thread of equal priority waits for leaves it with that priority: it
// told the kernel's tracer of the waiter before, as of no change.
TEST(ParametersUnchanged, TakesAPriorityThatWasThereBeforeForInheritedUntilTheKernelSaysMore) {
  const auto judged = [](const std::string& waited, const std::string& told, int prio) {
    return Verified("callback fusion\n-100 initial fusion\n" + waited +
                    "-90 applied fusion nice=15\n" + told + "6 switch 0 idle fusion next_prio=" +
                    std::to_string(prio) + "\n10 start fusion\n12 end fusion")["S3"];
  };
  constexpr auto kEqual = "-95 boost fusion prio=120\n";
  constexpr auto kUnboosted = "2 boost fusion prio=135\n";
  EXPECT_EQ(judged(kEqual, "", 135), Verdict::pass);
  EXPECT_EQ(judged(kEqual, "", 120), Verdict::inconclusive) << "nothing shows its own";
  EXPECT_EQ(judged(kEqual, "", 139), Verdict::fail) << "nobody inherits a lower priority";
  EXPECT_EQ(judged(kEqual, kUnboosted, 120), Verdict::fail) << "nobody waits any more";
  EXPECT_EQ(judged("", "", 120), Verdict::fail) << "nobody ever waited";
}

// What the kernel returns to is the thread's own priority: whoever had changed that would see it returned to his.
TEST(ParametersUnchanged, TakesAPriorityThatTheKernelTakesBackForInherited) {
  const auto judged = [](const std::string& told) {
    return Verified(
        "callback fusion\n-100 initial fusion\n-90 applied fusion nice=15\n"
        "6 switch 0 idle fusion next_prio=120\n" +
        told + "10 start fusion\n12 end fusion")["S3"];
  };
  EXPECT_EQ(judged("7 boost fusion prio=135 old=120\n"), Verdict::pass);
  EXPECT_EQ(judged(""), Verdict::fail);
  EXPECT_EQ(judged("7 boost fusion prio=120 old=120\n"), Verdict::fail) << "that is its own now";
  EXPECT_EQ(judged("7 boost fusion prio=135 old=110\n"), Verdict::fail) << "of another one";
  EXPECT_EQ(judged("7 boost fusion prio=135 old=120\n8 switch 0 fusion idle prio=120\n"),
            Verdict::fail)
      << "and again, which nobody waits for";
}

// Whoever waits for a thread may raise it and nothing else: what the kernel tells of waiters excuses no lower priority.
TEST(ParametersUnchanged, TakesNoLowerPriorityForInherited) {
  constexpr auto kLowered = "8 switch 0 idle fusion next_prio=120";
  EXPECT_EQ(Verified(configured_run(kLowered))["S3"], Verdict::fail);
  EXPECT_EQ(Verified(configured_run(std::string("5 boost fusion prio=9 old=19\n"
                                                "6 boost fusion prio=120 old=9\n") +
                                    kLowered))["S3"],
            Verdict::fail);
  EXPECT_EQ(
      Verified(configured_run(std::string("6 boost fusion prio=120 old=120\n") + kLowered))["S3"],
      Verdict::fail);
}

TEST(AllowedCpusOnly, FailsOnACpuOutsideTheMaskLastReadBack) {
  const Verified verified(configured_run("15 wakeup fusion cpu=2"));
  EXPECT_EQ(verified.of("S4", "thread 101"), Verdict::fail);
  EXPECT_THAT(verified.evidence("S4", "thread 101"),
              AllOf(HasSubstr("last read back: SCHED_FIFO 80 on CPUs 0,1"),
                    HasSubstr("15 cpu ran on CPU 2")));
  EXPECT_EQ(Verified(configured_run("14 applied fusion policy=fifo priority=80 cpus=2\n"
                                    "15 wakeup fusion cpu=2"))
                .of("S4", "thread 101"),
            Verdict::fail)
      << "the starts on CPU 0 come after the mask changed";
}

// A service manager confines what it starts (CPUAffinity=), the kernel keeps some CPUs apart (isolcpus=): the thread goes
// to the CPUs that it is given before anybody can read them back.
TEST(AllowedCpusOnly, LetsWhatIsAppliedFirstSendAThreadWhereItMightNotBeBefore) {
  const auto judged = [](const std::string& lines) {
    return Verified("callback fusion cpu=1\n-100 initial fusion cpus=0\n" + lines +
                    "\n10 start fusion cpu=1\n12 end fusion cpu=1")["S4"];
  };
  EXPECT_EQ(judged("-90 applied fusion cpus=1 cpu=1"), Verdict::pass);
  EXPECT_EQ(judged("-95 switch 1 idle fusion\n-90 applied fusion cpus=1 cpu=1"), Verdict::pass);
  EXPECT_EQ(judged("-95 switch 2 idle fusion\n-90 applied fusion cpus=1 cpu=1"), Verdict::fail)
      << "neither mask has CPU 2";
  EXPECT_EQ(judged("-90 applied fusion cpus=0"), Verdict::fail) << "that changed nothing";
  EXPECT_EQ(judged("-90 audit fusion cpus=0"), Verdict::fail) << "nothing was applied";
}

// Within a nanosecond, events of two CPUs may come in any order.
TEST(AllowedCpusOnly, AwaitsWhatIsAppliedFirstThoughAnAuditComesBeforeIt) {
  const auto judged = [](bool is_swapped, std::uint32_t lost = 99) {
    auto trace = trace_of(R"(
      callback fusion cpu=1
      -100 initial fusion cpus=0
      -95 switch 1 idle fusion
      -90 applied fusion cpus=1 cpu=1
      -90 audit fusion cpus=1 cpu=1
      10 start fusion cpu=1
      12 end fusion cpu=1)");
    const auto first =
        std::ranges::find(trace.events, -90, [](const Event& event) { return event.head.time.ns; });
    if (is_swapped) std::iter_swap(first, std::next(first));
    trace.erase<ThreadSched>(
        [lost](const ThreadSched& e, const EventHead&) { return e.n == lost; });
    return Verified(trace)["S4"];
  };
  EXPECT_EQ(judged(false), Verdict::pass);
  EXPECT_EQ(judged(true), Verdict::pass);
  EXPECT_EQ(judged(true, 1), Verdict::inconclusive) << "what was applied is lost";
}

// Whoever looks at a live system in that moment does not end it.
TEST(AllowedCpusOnly, AwaitsWhatIsAppliedFirstThoughSomebodyLooks) {
  const auto trace = trace_of(R"(
    callback fusion cpu=1
    -100 initial fusion cpus=0
    -95 switch 1 idle fusion
    -90 applied fusion cpus=1 cpu=1
    10 start fusion cpu=1
    12 end fusion cpu=1)");
  Analyzer analyzer(AnalysisOptions{});
  for (const auto& event : trace.events) {
    if (event.head.time.ns == -90) analyzer.look();
    analyzer.consume(event);
  }
  const auto result = analyzer.finish();
  const auto& rules = result.verdicts.rules;
  EXPECT_EQ(std::ranges::find(rules, "S4", &RuleVerdict::id)->verdict, Verdict::pass);
}

TEST(AllowedCpusOnly, SaysSampledWithoutSwitches) {
  const Verified sampled(configured_run(""));
  EXPECT_EQ(sampled.of("S4", "thread 101"), Verdict::pass);
  EXPECT_THAT(sampled.evidence("S4", "thread 101"), HasSubstr("sampled"));
  const Verified full(configured_run("9 switch 0 idle fusion next_prio=19"));
  EXPECT_EQ(full.of("S4", "thread 101"), Verdict::pass);
  EXPECT_EQ(full.evidence("S4", "thread 101"), "");
  EXPECT_EQ(Verified(configured_run("9 switch 3 idle fusion next_prio=19")).of("S4", "thread 101"),
            Verdict::fail);
}

TEST(AllowedCpusOnly, IsInconclusiveWithoutReadBack) {
  auto trace = trace_of("callback a\n1 start a\n2 end a");
  trace.erase<ThreadSched>();
  EXPECT_EQ(Verified(trace).of("S4", "thread 101"), Verdict::inconclusive);
}

// The events tell where they were; what the thread was allowed there is not known.
TEST(AllowedCpusOnly, SaysWhichReadBackIsMissing) {
  auto trace =
      trace_of("process app crash\n" + configured_run("30 audit fusion policy=fifo priority=80"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n < 2; });
  const Verified read_back_later(trace);
  EXPECT_EQ(read_back_later.of("S4", "thread 101"), Verdict::inconclusive);
  const auto evidence = read_back_later.evidence("S4", "thread 101");
  EXPECT_THAT(evidence, HasSubstr("30 thread_sched no read-back of the allowed CPUs holds for any "
                                  "event of the thread: this is the last one"));
  EXPECT_THAT(evidence, Not(HasSubstr("do not tell their CPU")));
}

TEST(AllowedCpusOnly, IsInconclusiveWhereEventsDoNotTellTheirCpu) {
  auto trace = trace_of(configured_run(""));
  for (auto& event : trace.events)
    event.head.cpu.reset();
  const Verified verified(trace);
  EXPECT_EQ(verified.of("S4", "thread 101"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("S4", "thread 101"), HasSubstr("events do not tell their CPU"));
}

TEST(AllowedCpusOnly, IsInconclusiveWhenAReadBackInBetweenWasLost) {
  auto trace =
      trace_of(configured_run("14 applied fusion policy=fifo priority=80 cpus=0,1,2\n"
                              "15 wakeup fusion cpu=2"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 2; });
  EXPECT_EQ(Verified(trace)["S4"], Verdict::inconclusive) << "no false FAIL";
}

// Of two fields that change one after the other, the one that the spec asks for.
TEST(ParametersUnchanged, ComparesEachFieldThatIsAskedFor) {
  constexpr const char* kClamp =
      "callback_groups:\n  - {id: fusion, policy: SCHED_OTHER, uclamp_min: 512}\n";
  const std::string both = R"(
    callback fusion
    1 initial fusion
    2 applied fusion slice=3000000 util_min=512 util_max=1024
    10 start fusion
    12 end fusion
    20 audit fusion slice=2800000 util_min=512 util_max=1024
    30 audit fusion slice=2800000 util_min=0 util_max=1024)";
  EXPECT_EQ(Verified(both, kClamp)["S3"], Verdict::fail);
}

}  // namespace
}  // namespace cie::test
