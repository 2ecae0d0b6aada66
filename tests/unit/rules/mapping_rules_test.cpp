#include "replaced_thread.hpp"
#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kPool = R"(
  process app executor=multi_threaded
  thread t1 pool tid=101
  thread t2 pool tid=102
  thread t3 pool tid=103
  callback fusion pooled
  callback plan pooled
  10 start fusion on=t1
  12 end fusion on=t1
  20 start plan on=t1
  22 end plan on=t1
  30 start fusion on=t2
  32 end fusion on=t2
  40 start plan on=t1
  42 end plan on=t1)";

TEST(OneCallbackPerThread, FailsWithTheFirstStartOfEach) {
  const Verified verified(kPool);
  EXPECT_EQ(verified.of("M2", "thread 101"), Verdict::fail);
  EXPECT_THAT(
      verified.evidence("M2", "thread 101"),
      AllOf(HasSubstr("10 callback_start fusion started here (seq 0), 1 time on this thread"),
            HasSubstr("20 callback_start plan started here (seq 0), 2 times on this thread")));
  EXPECT_EQ(verified.of("M2", "thread 102"), Verdict::pass);
  EXPECT_EQ(verified.of("M2", "thread 103"), Verdict::not_applicable);
  EXPECT_EQ(verified.on("M2", "thread 101").checked, 3U);
}

TEST(OneCallbackPerThread, TellsIncarnationsOfATidApart) {
  const Verified verified(R"(
    callback fusion pooled
    callback plan pooled
    thread t1 pool tid=101
    thread t2 pool tid=101
    -500 begin t1
    10 start fusion on=t1
    12 end fusion on=t1
    14 finish t1
    20 begin t2
    30 start plan on=t2
    32 end plan on=t2
    34 finish t2)");
  EXPECT_EQ(verified["M2"], Verdict::pass) << verified.evidence("M2", "thread 101");
  EXPECT_EQ(verified.rule("M2").subjects.size(), 2U);
}

TEST(OneCallbackPerThread, IsInconclusiveForAnUnknownCallback) {
  auto trace = trace_of("callback fusion\n10 start fusion\n12 end fusion");
  trace.erase<CallbackInit>();
  EXPECT_EQ(Verified(trace).of("M2", "thread 101"), Verdict::inconclusive);
}

TEST(OneCallbackPerThread, KeepsItsFailureUnderLoss) {
  auto trace = trace_of(kPool);
  trace.erase<CallbackStart>(
      [](const CallbackStart& e, const EventHead& head) { return e.seq == 1 && head.tid == 101; });
  EXPECT_EQ(Verified(trace).of("M2", "thread 101"), Verdict::fail);
}

TEST(OneCallbackPerThread, DoubtsTheWholePoolWhenAPooledCallbackLostAnInstance) {
  auto trace = trace_of(kPool);
  trace.erase<CallbackFini>(
      [](const CallbackFini& e, const EventHead&) { return e.callback == CallbackId{1}; });
  EXPECT_EQ(Verified(trace).of("M2", "thread 102"), Verdict::inconclusive)
      << "a later instance of plan may have run on it";
}

TEST(OneThreadPerCallback, FailsWhenBothThreadsWereAlive) {
  const Verified verified(kPool);
  EXPECT_EQ(verified.of("M3", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M3", "callback fusion"),
              AllOf(HasSubstr("10 callback_start fusion started here (seq 0)"),
                    HasSubstr("30 callback_start fusion started here (seq 1)"),
                    HasSubstr("42 callback_end thread 101 \"t1\" still runs plan")));
  EXPECT_EQ(verified.of("M3", "callback plan"), Verdict::pass);
  EXPECT_EQ(verified["M4"], Verdict::pass) << "threads that live together are no succession";
}

// The witness is whole: the one that ran it first had ended when the other ran it, but had seen its begin.
TEST(OneThreadPerCallback, ShowsThatTheLatterWasThereAlready) {
  const Verified verified(R"(
    thread t1 pool tid=301
    thread t2 pool tid=302
    callback a pooled
    8 begin t2
    10 start a on=t1
    12 end a on=t1
    20 finish t1
    30 start a on=t2
    32 end a on=t2)");
  EXPECT_EQ(verified["M3"], Verdict::fail);
  const auto evidence = verified.evidence("M3", "callback a");
  EXPECT_THAT(evidence, HasSubstr("8 thread_init thread 302 \"t2\" is there already"));
  EXPECT_THAT(evidence, Not(HasSubstr("thread_fini"))) << "it ran the callback after that";
}

TEST(OneThreadPerCallback, IsInconclusiveForACallbackThatLostInstances) {
  auto trace = trace_of("callback a\n1 start a\n2 end a\n3 start a\n4 end a\n5 start a\n6 end a");
  trace.erase<CallbackStart>([](const CallbackStart& e, const EventHead&) { return e.seq == 1; });
  EXPECT_EQ(Verified(trace).of("M3", "callback a"), Verdict::inconclusive);
}

TEST(UniqueLogicalId, FailsWhileBothLive) {
  const Verified verified(R"(
    callback a id=/n@Timer(10)
    callback b id=/n@Timer(10)
    1 start a
    2 end a
    3 start b
    4 end b)");
  EXPECT_EQ(verified.of("M7", "callback /n@Timer(10)"), Verdict::fail);
  EXPECT_EQ(verified.rule("M7").subjects.size(), 1U);
  EXPECT_THAT(verified.evidence("M7", "callback /n@Timer(10)"),
              AllOf(HasSubstr("registered as id 0"), HasSubstr("registered again as id 1")));
}

// What tells no id shares none.
TEST(UniqueLogicalId, IsUnknownOfCallbacksWithoutOne) {
  auto trace = trace_of(R"(
    callback a
    callback b
    1 start a
    2 end a
    3 start b
    4 end b)");
  for (auto& event : trace.events) {
    if (auto* init = std::get_if<CallbackInit>(&event.body)) init->logical_id = "";
  }
  const Verified verified(trace);
  EXPECT_EQ(verified["M7"], Verdict::inconclusive);
  for (const auto* callback : {"callback ?0", "callback ?1"}) {
    EXPECT_EQ(verified.of("M7", callback), Verdict::inconclusive) << callback;
    EXPECT_THAT(verified.evidence("M7", callback),
                HasSubstr("registered in part only: its logical id, which another may have, is "
                          "unknown"));
  }
}

TEST(UniqueLogicalId, AcceptsASuccessor) {
  auto trace = trace_of(R"(
    callback a id=/n@Timer(10)
    callback b id=/n@Timer(10)
    1 start a
    2 end a
    3 fini a
    5 init b
    6 start b
    7 end b)");
  trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
    return e.callback == CallbackId{1} && head.time.ns < 0;
  });
  EXPECT_EQ(Verified(trace)["M7"], Verdict::pass);
  trace.erase<CallbackFini>(
      [](const CallbackFini& e, const EventHead&) { return e.callback == CallbackId{0}; });
  EXPECT_EQ(Verified(trace)["M7"], Verdict::inconclusive) << "the first may have lived on";
}

// What run_end counts and no event names may have any id.
TEST(UniqueLogicalId, IsInconclusiveWhenACallbackWasNeverSeenAtAll) {
  constexpr const char* kRun = "callback fusion\n10 start fusion\n12 end fusion";
  EXPECT_EQ(Verified(kRun).of("M7", "callback fusion"), Verdict::pass);
  auto trace = trace_of(std::string(kRun) + "\ncallback plan");
  const auto is_of_plan = [](const auto& e, const EventHead&) {
    return e.callback == CallbackId{1};
  };
  ASSERT_EQ(trace.erase<CallbackInit>(is_of_plan), 1U);
  ASSERT_EQ(trace.erase<CallbackFini>(is_of_plan), 1U);
  const Verified verified(trace);
  EXPECT_EQ(verified.of("M7", "callback fusion"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("M7", "callback fusion"), HasSubstr("2 counted, 1 seen"));
}

// What ends and what begins in one nanosecond do not live together.
TEST(UniqueLogicalId, LivesThatTouchAreTwo) {
  auto trace = trace_of(R"(
    callback a id=/n@Timer timer
    callback b id=/n@Timer timer
    10 start a
    12 end a
    20 fini a
    20 init b
    30 start b
    32 end b)");
  trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
    return e.callback == CallbackId{1} && head.time.ns < 20;
  });
  EXPECT_EQ(Verified(trace)["M7"], Verdict::pass);
}

TEST(OneThreadPerCallback, ThreadsThatTouchDoNotLiveTogether) {
  EXPECT_EQ(Verified(R"(
    thread t1 pool tid=301
    thread t2 pool tid=302
    callback a pooled
    10 start a on=t1
    12 end a on=t1
    20 finish t1
    20 begin t2
    30 start a on=t2
    32 end a on=t2)")["M3"],
            Verdict::pass);
}

// The callback is moved to another thread, and the object of its first one is destroyed only after that,
// by whoever owns it.
TextTrace told_late(const std::string& more = "") {
  auto trace = trace_of(R"(
    process app executor=multi_threaded
    callback fusion pooled
    thread t1 pool tid=101
    thread t2 pool tid=102
    -500 begin t1
    10 start fusion on=t1
    12 end fusion on=t1
    18 init fusion
    20 begin t2
    30 start fusion on=t2
    32 end fusion on=t2
    40 finish t1)" + more);
  for (auto& event : trace.events)
    if (event.head.time.ns == 40 && std::holds_alternative<ThreadFini>(event.body))
      event.head.tid = 100;
  return trace;
}

TEST(OneThreadPerCallback, TakesNoLifeFromAnEndThatAnotherThreadTells) {
  const Verified verified(told_late());
  EXPECT_EQ(verified["M3"], Verdict::inconclusive) << verified.evidence("M3", "callback fusion");
  EXPECT_THAT(verified.evidence("M3", "callback fusion"), HasSubstr("nor that it lived on"));
  EXPECT_NE(verified["M4"], Verdict::fail);
  EXPECT_EQ(Verified(told_late("\n34 start fusion on=t1\n36 end fusion on=t1"))["M3"],
            Verdict::fail)
      << "it runs it later";
}

TEST(OneThreadPerCallback, TakesItsExitForTheEndOfAThreadThatAnotherOneTellsOfLater) {
  const std::string ran = "\n9 switch 0 idle t1\n13 switch 0 t1 idle state=1";
  const Verified exited(told_late(ran + "\n14 exit t1"));
  EXPECT_EQ(exited["M3"], Verdict::pass) << exited.evidence("M3", "callback fusion");
  EXPECT_EQ(exited["M4"], Verdict::pass);
  const Verified alive(
      told_late(ran + "\n25 switch 0 idle t1\n26 switch 0 t1 idle state=1\n35 exit t1"));
  EXPECT_EQ(alive["M3"], Verdict::fail);
  EXPECT_THAT(alive.evidence("M3", "callback fusion"), HasSubstr("35 sched_process_exit"));
}

TEST(OneThreadPerCallback, TakesItsOwnThreadFiniForASignOfLife) {
  auto trace = told_late();
  for (auto& event : trace.events)
    if (event.head.time.ns == 40 && std::holds_alternative<ThreadFini>(event.body))
      event.head.tid = 101;
  const Verified verified(trace);
  EXPECT_EQ(verified["M3"], Verdict::fail);
  EXPECT_THAT(verified.evidence("M3", "callback fusion"), HasSubstr("40 thread_fini"));
}

// The same where there are too many threads to hold each against each.
TEST(OneThreadPerCallback, TakesNoLifeFromAnEndThatIsToldLateAmongManyThreads) {
  std::string many = "\n33 finish t2";
  for (int i = 0; i < 70; ++i) {
    const auto name = "m" + std::to_string(i);
    const auto at = [i](int offset) { return '\n' + std::to_string(100 + 10 * i + offset); };
    many += "\nthread " + name + " pool tid=" + std::to_string(200 + i) + at(0) + " init fusion" +
            at(1) + " begin " + name + at(2) + " start fusion on=" + name + at(3) +
            " end fusion on=" + name + at(4) + " finish " + name;
  }
  EXPECT_EQ(Verified(told_late(many))["M3"], Verdict::inconclusive);
}

// A move without a new registration: M4 shows the exit, not what was told of it later.
TEST(MappingPersistent, ShowsTheExitOfAThreadWhoseEndIsToldLater) {
  auto trace = told_late("\n9 switch 0 idle t1\n13 switch 0 t1 idle state=1\n14 exit t1");
  trace.erase<CallbackInit>(
      [](const CallbackInit&, const EventHead& head) { return head.time.ns == 18; });
  const Verified verified(trace);
  EXPECT_EQ(verified["M4"], Verdict::fail);
  EXPECT_THAT(verified.evidence("M4", "callback fusion"),
              AllOf(HasSubstr("14 sched_process_exit"), Not(HasSubstr("thread_fini"))));
}

// The process was killed: no event of its own tells when t1 ended.
constexpr const char* kKilled = R"(
  process app executor=multi_threaded crash
  callback fusion pooled
  thread t1 pool tid=101
  thread t2 pool tid=102
  -500 begin t1
  9 switch 0 idle t1
  10 start fusion on=t1
  12 end fusion on=t1
  13 switch 0 t1 idle state=1
  20 begin t2
  29 switch 0 idle t2
  30 start fusion on=t2
  32 end fusion on=t2
  33 switch 0 t2 idle state=1)";

TEST(OneThreadPerCallback, FailsWhereTheKernelSawTheFormerThreadAliveLater) {
  const std::string killed = kKilled;
  EXPECT_EQ(Verified(killed)["M3"], Verdict::inconclusive) << "nothing shows it alive later";
  const std::string later = "\n25 switch 1 idle t1\n26 switch 1 t1 idle state=1";
  const Verified alive(killed + later);
  EXPECT_EQ(alive["M3"], Verdict::fail);
  EXPECT_THAT(alive.evidence("M3", "callback fusion"),
              AllOf(HasSubstr("10 callback_start"), HasSubstr("30 callback_start"),
                    HasSubstr("25 sched_switch thread 101 \"t1\" still runs")));
  EXPECT_EQ(Verified(killed + "\n15 switch 1 idle t1\n16 switch 1 t1 idle state=1")["M3"],
            Verdict::inconclusive)
      << "before t2 began";
}

// t1's end was not seen; behind a hole, and in a container, its tid is somebody else's.
TEST(OneThreadPerCallback, TakesNoExitOfSomebodyElseForThatOfTheFormerThread) {
  const std::string killed = kKilled;
  EXPECT_EQ(Verified(killed + "\n34 exit t1")["M3"], Verdict::fail) << "it was there until then";
  EXPECT_EQ(Verified(killed + "\n15 discard kernel until=17 count=1\n34 exit t1")["M3"],
            Verdict::inconclusive);
  auto contained = trace_of(killed +
                            "\nprocess inside pid=200 from=15\ncallback tick timer\n"
                            "40 start tick\n42 end tick");
  for (auto& event : contained.events) {
    if (event.head.pid != 200) continue;
    if (event.head.tid == 103) event.head.tid = 101;
    if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->pid_ns = 0xf0000005;
    if (auto* init = std::get_if<ThreadInit>(&event.body)) init->tid = 101;
    if (auto* read = std::get_if<ThreadSched>(&event.body)) read->tid = 101;
    if (auto* fini = std::get_if<ThreadFini>(&event.body)) fini->tid = 101;
  }
  EXPECT_EQ(Verified(contained)["M3"], Verdict::inconclusive);
}

TEST(OneThreadPerCallback, IsInconclusiveWhereTheTidMayBeAnotherThreadsByThen) {
  const auto later = std::string(kKilled) + "\n25 switch 1 idle t1\n26 switch 1 t1 idle state=1\n";
  for (const auto* meanwhile :
       {"15 exit t1", "15 switch 1 idle t1\n16 switch 1 t1 idle state=16", "15 fork t2 t1",
        "15 discard kernel until=17 count=1", "15 discard user until=17 count=1"}) {
    EXPECT_NE(Verified(later + meanwhile)["M3"], Verdict::fail) << meanwhile;
  }
}

// A thread may run on after its `thread_fini`, of which the one here is lost.
TEST(OneThreadPerCallback, IsInconclusiveWhereTheFormerThreadsEndWasLost) {
  auto trace =
      trace_of(std::string(kReplaced) + "\n34 switch 1 idle t1\n35 switch 1 t1 idle state=1");
  EXPECT_EQ(Verified(trace)["M3"], Verdict::pass);
  trace.erase<ThreadFini>([](const ThreadFini& e, const EventHead&) { return e.tid == 101; });
  EXPECT_EQ(Verified(trace)["M3"], Verdict::inconclusive);
}

// Each of 80 threads ends before the next begins, but for the last two.
TEST(OneThreadPerCallback, ComparesHoweverManyThreads) {
  const auto judged = [](bool is_last_together) {
    std::string text = "callback fusion pooled\n";
    for (int i = 0; i < 80; ++i) {
      const auto name = "t" + std::to_string(i);
      const auto at = [i](int offset) { return "\n" + std::to_string(100 * i + offset) + ' '; };
      const bool is_late = is_last_together && i == 78;
      text += "thread " + name + " callback of=fusion tid=" + std::to_string(500 + i) + at(1) +
              "begin " + name + at(10) + "start fusion on=" + name + at(12) +
              "end fusion on=" + name + at(14) + "init fusion" + at(is_late ? 150 : 20) +
              "finish " + name + '\n';
    }
    return Verified(text);
  };
  EXPECT_EQ(judged(false)["M3"], Verdict::pass);
  const auto together = judged(true);
  EXPECT_EQ(together["M3"], Verdict::fail);
  EXPECT_THAT(together.evidence("M3", "callback fusion"),
              AllOf(HasSubstr("7810 callback_start"), HasSubstr("7910 callback_start")));
}

}  // namespace
}  // namespace cie::test
