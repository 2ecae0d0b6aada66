#include "support/verdicts.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kThreeInstances = R"(
  publisher out topic=/out
  callback fusion subscription topic=/points
  10 start fusion
  12 publish out on=fusion
  14 end fusion
  20 start fusion
  22 publish out on=fusion
  24 end fusion
  30 start fusion
  32 publish out on=fusion
  34 end fusion)";

template <typename Event>
void drop_seq(TextTrace& trace, std::uint64_t seq) {
  const auto dropped =
      trace.erase<Event>([seq](const Event& event, const EventHead&) { return event.seq == seq; });
  ASSERT_EQ(dropped, 1U);
}

TEST(SeqContiguous, NamesTheHoleOfACallback) {
  EXPECT_EQ(Verified(kThreeInstances).of("T3", "callback fusion"), Verdict::pass);
  auto trace = trace_of(kThreeInstances);
  drop_seq<CallbackStart>(trace, 1);
  drop_seq<CallbackEnd>(trace, 1);
  const Verified verified(trace);
  EXPECT_EQ(verified.of("T3", "callback fusion"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T3", "callback fusion"),
              HasSubstr("30 callback_start seq jumps: 1 was next and 2 came"));
}

TEST(SeqContiguous, ExpectsThePromisedFirstNumber) {
  auto trace = trace_of(kThreeInstances);
  drop_seq<CallbackStart>(trace, 0);
  drop_seq<CallbackEnd>(trace, 0);
  EXPECT_EQ(Verified(trace).of("T3", "callback fusion"), Verdict::inconclusive);
}

TEST(SeqContiguous, AcceptsThatAnAttachedProcessCountedBefore) {
  const Verified verified(R"(
    process app attached
    callback fusion subscription next=7
    5 end fusion seq=6        # cut by the window's begin
    10 start fusion
    14 end fusion)");
  EXPECT_EQ(verified.of("T3", "callback fusion"), Verdict::pass);
}

TEST(SeqContiguous, NamesTheHoleAmongTheEndsOfACallback) {
  for (const std::uint64_t lost : {0U, 1U}) {
    auto trace = trace_of(kThreeInstances);
    drop_seq<CallbackEnd>(trace, lost);
    const Verified verified(trace);
    EXPECT_EQ(verified.of("T3", "callback fusion"), Verdict::inconclusive) << lost;
    EXPECT_THAT(verified.evidence("T3", "callback fusion"),
                HasSubstr("callback_end seq jumps: " + std::to_string(lost) + " was next"));
  }
}

TEST(SeqContiguous, NamesTheHoleAmongTheEndsOfAProcessThatCrashed) {
  auto trace = trace_of(std::string("process app crash") + kThreeInstances);
  EXPECT_EQ(Verified(trace).of("T3", "callback fusion"), Verdict::pass);
  drop_seq<CallbackEnd>(trace, 1);
  EXPECT_EQ(Verified(trace).of("T3", "callback fusion"), Verdict::inconclusive);
}

TEST(SeqContiguous, CountsTheNumbersThatCameTwice) {
  const auto said = [](const std::string& more) {
    const Verified verified("    callback fusion\n" + std::string(R"(
    10 start fusion seq=0
    14 end fusion seq=0
    20 start fusion seq=0
    24 end fusion seq=0)") + more);
    return verified.evidence("T3", "callback fusion");
  };
  EXPECT_THAT(said(""), HasSubstr("does not rise: 1 number came twice"));
  EXPECT_THAT(said("\n    30 start fusion seq=0\n    34 end fusion seq=0"),
              HasSubstr("does not rise: 2 numbers came twice"));
}

TEST(SeqContiguous, MissesNoEndOfAnInstanceThatNeverEnded) {
  // Left by longjmp(): the totals count an end less.
  const Verified verified(R"(
    callback fusion
    10 start fusion
    20 start fusion
    24 end fusion seq=1)");
  EXPECT_EQ(verified.of("T3", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.of("E1", "callback fusion"), Verdict::fail);
}

TEST(SeqContiguous, MissesNoEndOfAnInstanceThatStillRanWhenTheRecordEnded) {
  const Verified verified(R"(
    process app crash
    group g reentrant
    callback fusion group=g pooled
    thread t1 pool
    thread t2 pool
    10 start fusion on=t1
    20 start fusion on=t2
    24 end fusion on=t2 seq=1)");
  EXPECT_EQ(verified.of("T3", "callback fusion"), Verdict::pass);
}

TEST(SeqContiguous, NamesPublishersAndThreadsOnlyWhenTheirNumbersJump) {
  EXPECT_EQ(Verified(kThreeInstances).rule("T3").subjects.size(), 1U);
  auto trace = trace_of(kThreeInstances);
  drop_seq<Publish>(trace, 1);
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 1; });
  const Verified verified(trace);
  EXPECT_EQ(verified.of("T3", "topic /out"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("T3", "thread 101"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("T3", "callback fusion"), Verdict::pass);
}

TEST(RunComplete, ComparesEveryTotalWithWhatWasSeen) {
  EXPECT_EQ(Verified(kThreeInstances).of("T4", "process 100"), Verdict::pass);

  auto trace = trace_of(kThreeInstances);
  drop_seq<CallbackEnd>(trace, 2);
  EXPECT_THAT(Verified(trace).evidence("T4", "process 100"),
              HasSubstr("fusion ended: 3 counted, 2 seen"));

  trace = trace_of(kThreeInstances);
  drop_seq<Publish>(trace, 2);
  EXPECT_THAT(Verified(trace).evidence("T4", "process 100"),
              HasSubstr("/out published: 3 counted, 2 seen"));

  trace = trace_of(kThreeInstances);
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 2; });
  EXPECT_THAT(Verified(trace).evidence("T4", "process 100"),
              HasSubstr("thread 101 read back: 3 counted, 2 seen"));

  trace = trace_of(kThreeInstances);
  trace.erase<ThreadInit>();
  EXPECT_THAT(Verified(trace).evidence("T4", "process 100"),
              HasSubstr("threads: 1 counted, 0 seen"));

  trace = trace_of(kThreeInstances);
  trace.erase<CallbackFini>();
  EXPECT_THAT(Verified(trace).evidence("T4", "process 100"),
              HasSubstr("fusion has no callback_fini"));
}

TEST(RunComplete, AsksForTheEndOfTheLastRun) {
  auto trace = trace_of(kThreeInstances);
  const auto is = [](const auto& kind) {
    return [index = analysis::EventBody(kind).index()](const Event& event) {
      return event.body.index() == index;
    };
  };
  auto again = *std::ranges::find_if(trace.events, is(RunBegin{}));
  const auto end = std::ranges::find_if(trace.events, is(RunEnd{}));
  again.head.time = end->head.time;
  trace.events.insert(std::next(end), again);
  const Verified verified(trace);
  EXPECT_EQ(verified.of("T4", "process 100"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T4", "process 100"),
              HasSubstr(" no run_end: interrupted by the end of the recording"));
}

TEST(RunComplete, ComparesReleases) {
  constexpr auto kText = R"(
    callback fusion subscription
    9 release fusion
    10 start fusion
    11 end fusion
    19 release fusion
    20 start fusion
    21 end fusion)";
  EXPECT_EQ(Verified(kText)["T4"], Verdict::pass);
  auto trace = trace_of(kText);
  trace.erase<CallbackRelease>(
      [](const CallbackRelease& e, const EventHead&) { return e.release_seq == 1; });
  EXPECT_THAT(Verified(trace).evidence("T4", "process 100"),
              HasSubstr("fusion released: 2 counted, 1 seen"));
  EXPECT_EQ(Verified(trace).of("M3", "callback fusion"), Verdict::inconclusive)
      << "a total that disagrees taints its callback";
}

TEST(RunComplete, CallsACrashInterruptedAndCanAcceptIt) {
  constexpr auto kCrash = R"(
    process app crash
    callback fusion subscription
    10 start fusion
    12 end fusion
    20 start fusion)";
  const Verified verified(kCrash);
  EXPECT_EQ(verified.of("T4", "process 100"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T4", "process 100"), HasSubstr("20  no run_end: "));
  EXPECT_EQ(verified["M2"], Verdict::pass) << "the other rules still judge the window";
  EXPECT_EQ(verified["E1"], Verdict::pass) << "the open instance is cut, not unpaired";

  AnalysisOptions options;
  options.allow_crash = true;
  EXPECT_EQ(Verified(trace_of(kCrash), {}, options)["T4"], Verdict::pass);
}

TEST(RunComplete, NeedsTheBeginning) {
  auto trace = trace_of(kThreeInstances);
  trace.erase<RunBegin>();
  EXPECT_EQ(Verified(trace).of("T4", "process 100"), Verdict::inconclusive);
}

// Of what else it did nothing is known.
TEST(RunComplete, NamesAProcessOfWhichOneEventIsSeen) {
  const auto trace = trace_of(std::string(kThreeInstances) + R"(
    process other pid=200 attached
    publisher to topic=/to
    callback plan subscription topic=/out
    10 wakeup plan
    11 release plan overwritten=1
    12 start plan
    13 publish to on=plan
    14 end plan
    15 audit plan
    16 lost plan count=1)");
  const auto is_of_other = [](const Event& event) {
    return event.head.pid && *event.head.pid == 200;
  };
  std::set<std::size_t> kinds;
  for (const auto& event : trace.events) {
    const bool keeps_time = std::holds_alternative<ClockSync>(event.body);
    if (is_of_other(event) && !keeps_time) kinds.insert(event.body.index());
  }
  EXPECT_GE(kinds.size(), 14U);
  for (const auto kind : kinds) {
    auto one = trace;
    std::erase_if(one.events, [&](const Event& event) {
      return is_of_other(event) && event.body.index() != kind;
    });
    const Verified verified(one, "callback_groups:\n  - id: elsewhere\n");
    const auto name = kEventNames[kind];
    EXPECT_EQ(verified.of("T4", "process 200 (pid 200)"), Verdict::inconclusive) << name;
    EXPECT_EQ(verified["M1"], Verdict::inconclusive) << name;
    EXPECT_FALSE(verified.result.report.trace.complete) << name;
    ASSERT_EQ(verified.result.report.processes.size(), 2U) << name;
    for (const auto& rule : verified.result.verdicts.rules) {
      for (const auto& subject : rule.subjects) {
        EXPECT_TRUE(std::ranges::none_of(subject.evidence,
                                         [](const Evidence& evidence) {
                                           return evidence.time == Timestamp{0} &&
                                                  evidence.event == "callback_start";
                                         }))
            << name << ' ' << rule.id;
      }
    }
    for (const auto& callback : verified.result.report.callbacks) {
      const bool has_run = kind == EventBody(CallbackStart{}).index() ||
                           kind == EventBody(CallbackEnd{}).index() ||
                           kind == EventBody(CallbackFini{}).index();
      if (callback.process != ProcessIndex{1}) continue;
      EXPECT_EQ(callback.never_ran(), !has_run) << name;
    }
  }
}

constexpr const char* kSpecOfBoth = "callback_groups:\n  - id: fusion\n  - id: plan\n";

TEST(SpecifiedCallbackSeen, FailsForACallbackThatWasNeverRegistered) {
  const Verified verified(kThreeInstances, kSpecOfBoth);
  EXPECT_EQ(verified.of("M1", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.of("M1", "callback plan"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "callback plan"),
              AllOf(HasSubstr("was never registered (spec.yaml:3)"),
                    HasSubstr("1 callbacks were registered, all of them seen")));
}

TEST(SpecifiedCallbackSeen, DoesNotSayThatAllWereSeenWhereOneIsMissing) {
  auto trace =
      trace_of(std::string(kThreeInstances) + "\ncallback plan\n40 start plan\n41 end plan");
  const auto is_of_plan = [](const auto& event, const EventHead&) {
    return to_number(event.callback) == 1;
  };
  trace.erase<CallbackInit>(is_of_plan);
  trace.erase<CallbackFini>(is_of_plan);
  trace.erase<CallbackStart>(is_of_plan);
  trace.erase<CallbackEnd>(is_of_plan);
  const Verified verified(trace, kSpecOfBoth);
  EXPECT_EQ(verified.of("M1", "callback plan"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("M1", "callback plan"),
              AllOf(HasSubstr("2 counted, 1 seen"), Not(HasSubstr("all of them seen"))));
}

// Periods, releases and deadlines are the timer's, whatever it is called.
TEST(SpecifiedCallbackSeen, FindsATimerWithANameByItAndByItsPeriod) {
  constexpr const char* kNamed = R"(
    callback tick timer id=/n@Timer(tick) period=100
    100 start tick release=100
    130 end tick
    305 start tick release=300 missed=1
    360 end tick)";
  const auto of = [](const std::string& spec) {
    return Verified(kNamed, "callback_groups:\n" + spec);
  };
  const std::string by_period = "  - {id: /n@Timer(100), response_deadline: 50ns}\n";
  const std::string by_name = "  - {id: /n@Timer(tick), response_deadline: 60ns}\n";
  constexpr const char* kSubject = "callback /n@Timer(tick)";
  for (const auto& spec : {by_period, by_name, by_period + by_name})
    EXPECT_EQ(of(spec).of("M1", kSubject), Verdict::pass) << spec;
  EXPECT_EQ(of(by_period).of("R3", kSubject), Verdict::fail) << "360 - 300 > 50";
  EXPECT_EQ(of(by_name).of("R3", kSubject), Verdict::pass);
  EXPECT_EQ(of(by_period).of("R2", kSubject), Verdict::fail) << "a period was skipped";
  EXPECT_EQ(of("  - {id: /n@Timer(200)}\n").of("M1", "callback /n@Timer(200)"), Verdict::fail);
}

TEST(SpecifiedCallbackSeen, FailsForACallbackThatNeverRan) {
  const Verified verified(std::string(kThreeInstances) + "\ncallback plan timer", kSpecOfBoth);
  EXPECT_EQ(verified.of("M1", "callback plan"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "callback plan"), HasSubstr("started 0 times"));
}

// After a restart one lifetime that ran is enough; of two processes at the same time each has its own.
TEST(SpecifiedCallbackSeen, AsksForEachOfThoseThatLiveAtTheSameTime) {
  const auto judged = [](const std::string& second) {
    return Verified(
        "process one pid=100 until=60\ncallback a id=/n@Subscription(/t)\n"
        "10 start a\n12 end a\nprocess two pid=200 " +
            second + "\ncallback b id=/n@Subscription(/t)\n" + "200 wakeup b",
        "callback_groups:\n  - id: /n@Subscription(/t)\n    response_deadline: 50\n")["M1"];
  };
  EXPECT_EQ(judged("from=100 until=300"), Verdict::pass);
  EXPECT_EQ(judged("until=300"), Verdict::fail);
}

// As in a container, where it is the same at each start.
TEST(SpecifiedCallbackSeen, OneLifetimeThatRanIsEnoughUnderTheSamePid) {
  auto trace = trace_of(
      "process one pid=100 until=60\ncallback a id=/n@Subscription(/t)\n10 start a\n12 end a\n"
      "process two pid=200 from=100 until=300\ncallback b id=/n@Subscription(/t)\n"
      "200 wakeup b");
  for (auto& event : trace.events) {
    if (event.head.pid != 200) continue;
    event.head.pid = 100;
    if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->pid = 100;
  }
  const Verified verified(trace, "callback_groups:\n  - id: /n@Subscription(/t)\n");
  EXPECT_EQ(verified.result.report.processes.size(), 2U);
  EXPECT_EQ(verified["M1"], Verdict::pass);
}

// An entry by its period means each such timer: one that ran excuses no other.
TEST(SpecifiedCallbackSeen, AsksForEachTimerThatAnEntryMeans) {
  const Verified verified(
      "callback a id=/n@Timer(1000) timer period=1000\n"
      "callback b id=/n@Timer(tick) timer period=1000\n"
      "10 start b\n12 end b",
      "callback_groups:\n  - id: /n@Timer(1000)\n    response_deadline: 50\n");
  EXPECT_EQ(verified.of("M1", "callback /n@Timer(1000)"), Verdict::fail);
}

TEST(SpecifiedCallbackSeen, IsInconclusiveWithoutProofOfCompleteness) {
  auto trace = trace_of(kThreeInstances);
  trace.erase<PublisherFini>();
  EXPECT_EQ(Verified(trace, kSpecOfBoth).of("M1", "callback plan"), Verdict::inconclusive);
  EXPECT_EQ(Verified(trace, kSpecOfBoth).of("M1", "callback fusion"), Verdict::pass);
}

TEST(SpecifiedCallbackSeen, AcceptsWhatRanBeforeTheRecorderAttached) {
  const Verified verified(R"(
    process app attached
    callback fusion subscription next=3
    callback plan timer next=0)",
                          kSpecOfBoth);
  EXPECT_EQ(verified.of("M1", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.of("M1", "callback plan"), Verdict::fail);
}

// That it was not registered is told by no event but the totals.
TEST(SpecifiedCallbackSeen, NamesNoEventOfWhatWasNotRegistered) {
  const Verified verified(kThreeInstances, "callback_groups:\n  - id: brake\n");
  const auto& evidence = verified.on("M1", "callback brake").evidence;
  ASSERT_EQ(evidence.size(), 2U);
  EXPECT_EQ(evidence[0].event, "");
  EXPECT_EQ(evidence[1].event, "run_end");
}

// No number of the processes that were seen tells of one that was not.
TEST(SpecifiedCallbackSeen, IsInconclusiveWhereAWholeProcessMayBeLost) {
  constexpr const char* kSpec = "callback_groups:\n  - id: brake\n";
  EXPECT_EQ(Verified(kThreeInstances, kSpec).of("M1", "callback brake"), Verdict::fail);
  const auto lossy = std::string(kThreeInstances) + "\n500 discard user until=510 count=30";
  const Verified verified(lossy, kSpec);
  EXPECT_EQ(verified["T3"], Verdict::pass);
  EXPECT_EQ(verified.of("M1", "callback brake"), Verdict::inconclusive);
}

TEST(SpecifiedCallbackSeen, SaysWhatWasProbablyMeant) {
  const Verified verified(kThreeInstances, "callback_groups:\n  - id: fussion\n");
  EXPECT_EQ(verified.of("M1", "callback fussion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "callback fussion"), HasSubstr("; did you mean \"fusion\"?"));
}

// A second entry of that name would be an error of the spec.
TEST(SpecifiedCallbackSeen, SuggestsNoIdThatHasAnEntry) {
  const Verified verified(kThreeInstances, "callback_groups:\n  - id: fusion\n  - id: fussion\n");
  EXPECT_EQ(verified.of("M1", "callback fussion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "callback fussion"), Not(HasSubstr("did you mean")));
}

TEST(SpecifiedCallbackSeen, SuggestsIdsWithAnEntryForMembersOfChains) {
  const Verified verified(kThreeInstances,
                          "callback_groups:\n  - id: fusion\n"
                          "chains:\n  - {name: brake, callbacks: [fusoin]}\n");
  EXPECT_THAT(verified.evidence("M1", "callback fusoin"), HasSubstr("did you mean \"fusion\"?"));
}

TEST(SpecifiedCallbackSeen, AsksForTheMembersOfChains) {
  constexpr const char* kChains = R"(
chains:
  - {name: brake, callbacks: [fusoin, fusion]}
  - {name: again, callbacks: [fusoin]}
)";
  const Verified verified(kThreeInstances, kChains);
  EXPECT_EQ(verified.of("M1", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.of("M1", "callback fusoin"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "callback fusoin"),
              HasSubstr("was never registered (chain brake, spec.yaml:3); did "
                        "you mean \"fusion\"?"));
  auto trace = trace_of(kThreeInstances);
  trace.erase<RunEnd>();
  EXPECT_EQ(Verified(trace, kChains).of("M1", "callback fusoin"), Verdict::inconclusive);
}

TEST(SpecifiedCallbackSeen, AsksForThreads) {
  constexpr const char* kThreads = "non_ros_threads:\n  - id: recv\n  - id: pumpp\n";
  const auto text = std::string(kThreeInstances) + R"(
  thread recv worker tid=70
  thread pump worker tid=71)";
  const Verified verified(text, kThreads);
  EXPECT_EQ(verified.of("M1", "thread recv"), Verdict::pass);
  EXPECT_EQ(verified.of("M1", "thread pumpp"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "thread pumpp"),
              AllOf(HasSubstr("was never announced (spec.yaml:3); did "
                              "you mean \"pump\"?"),
                    HasSubstr("threads were announced, all of them seen")));
  auto trace = trace_of(text);
  trace.erase<RunEnd>();
  EXPECT_EQ(Verified(trace, kThreads).of("M1", "thread pumpp"), Verdict::inconclusive);
  EXPECT_EQ(Verified(text, "dds_threads:\n  - name: recvMC\n")["M1"], Verdict::not_applicable)
      << "which threads DDS has is its own affair";
}

TEST(SpecifiedCallbackSeen, SaysWhereTheEntryOfACallbacksThreadBelongs) {
  const Verified verified(kThreeInstances, "non_ros_threads:\n  - id: fusion\n");
  EXPECT_EQ(verified.of("M1", "thread fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M1", "thread fusion"),
              HasSubstr("thread_init thread 101 \"fusion\" is a callback's thread: what "
                        "spec.yaml:2 asks for belongs into callback_groups"));
}

TEST(SpecifiedCallbackSeen, DoesNotAskForWildcards) {
  EXPECT_EQ(Verified(kThreeInstances, "callback_groups:\n  - id: /nobody/*\n")["M1"],
            Verdict::not_applicable);
  EXPECT_EQ(Verified(kThreeInstances)["M1"], Verdict::not_applicable);
}

TEST(SpecifiedCallbackSeen, SaysWhereParametersAreAppliedToNoThread) {
  constexpr const char* kFifo10 =
      "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 10}\n";
  const Verified pooled(
      "thread t1 pool\ncallback fusion pooled\n10 start fusion on=t1\n12 end fusion on=t1",
      kFifo10);
  EXPECT_EQ(pooled["M1"], Verdict::pass);
  EXPECT_EQ(pooled["S1"], Verdict::not_applicable);
  EXPECT_THAT(pooled.evidence("M1", "callback fusion"),
              HasSubstr("10 not applied no thread is its own"));
  const Verified other(
      "thread t1 pool\n5 applied t1 policy=fifo priority=40\ncallback fusion pooled\n"
      "10 start fusion on=t1\n12 end fusion on=t1",
      kFifo10);
  EXPECT_EQ(other["S1"], Verdict::not_applicable);
  EXPECT_THAT(other.evidence("M1", "callback fusion"), HasSubstr("runs SCHED_FIFO 40"));
  const Verified isolated("callback fusion\n10 start fusion\n12 end fusion", kFifo10);
  EXPECT_EQ(isolated.evidence("M1", "callback fusion"), "");
}

}  // namespace
}  // namespace cie::test
