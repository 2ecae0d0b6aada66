// `--window`: a part of a recording is judged as if the rest were sound, and by what the rest
// knows.
#include "support/move_to_host.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

AnalysisOptions window(std::int64_t from, std::int64_t to) {
  AnalysisOptions options;
  options.window = TimeWindow{.from = {from}, .to = {to}};
  return options;
}

Verified in_window(std::string_view trace, std::int64_t from, std::int64_t to,
                   std::string_view spec = {}) {
  return Verified(trace_of(trace), spec, window(from, to));
}

const CallbackReport& callback(const Verified& verified, std::string_view id) {
  return *std::ranges::find(verified.result.report.callbacks, id, &CallbackReport::logical_id);
}

// A timer publishes to a subscription; five periods of 20, with everything that can be recorded.
constexpr const char* kSound = R"(
  kernel
  publisher out topic=/t
  callback plan timer period=20
  callback fusion subscription topic=/t cpu=1
  10 switch 0 idle plan
  10 wakeup plan
  11 start plan release=10
  13 publish out on=plan
  14 release fusion on=plan
  14 waking fusion
  15 end plan
  15 switch 0 plan idle state=1
  15 switch 1 idle fusion
  16 start fusion release=14 from=out:0
  18 end fusion
  18 switch 1 fusion idle state=1
  30 switch 0 idle plan
  31 start plan release=30
  33 publish out on=plan
  34 release fusion on=plan
  34 waking fusion
  35 end plan
  35 switch 0 plan idle state=1
  35 switch 1 idle fusion
  36 start fusion release=34 from=out:1
  38 end fusion
  38 switch 1 fusion idle state=1
  50 switch 0 idle plan
  51 start plan release=50
  53 publish out on=plan
  54 release fusion on=plan
  54 waking fusion
  55 end plan
  55 switch 0 plan idle state=1
  55 switch 1 idle fusion
  56 start fusion release=54 from=out:2
  58 end fusion
  58 switch 1 fusion idle state=1
  60 switch 0 idle plan
  60 switch 1 idle fusion)";

constexpr const char* kSoundSpec = R"(
callback_groups:
  - {id: plan, policy: SCHED_OTHER, affinity: [0, 1], response_deadline: 5, wcet: 4, foreign_work_budget: 1000000000}
  - {id: fusion, response_deadline: 5}
chains:
  - {name: brake, callbacks: [plan, fusion], path_latency: 8, reaction_time: 100, data_age: 100}
)";

TEST(Window, NoPartOfASoundRecordingViolatesOrDoubtsAnything) {
  const std::vector<std::pair<std::int64_t, std::int64_t>> plan{{11, 15}, {31, 35}, {51, 55}};
  const std::vector<std::pair<std::int64_t, std::int64_t>> fusion{{16, 18}, {36, 38}, {56, 58}};
  for (std::int64_t from = 0; from <= 70; ++from) {
    for (std::int64_t to = from; to <= 70; ++to) {
      const auto verified = in_window(kSound, from, to, kSoundSpec);
      const auto where = std::to_string(from) + ".." + std::to_string(to);
      const auto inside = [from, to](const auto& instances) {
        return static_cast<std::uint64_t>(std::ranges::count_if(
            instances, [&](const auto& i) { return from <= i.first && i.second <= to; }));
      };
      EXPECT_EQ(callback(verified, "plan").instances, inside(plan)) << where;
      EXPECT_EQ(callback(verified, "fusion").instances, inside(fusion)) << where;
      // An instance needs a start in the window before anything can be said.
      const auto starts = [from, to](const auto& instances) {
        return std::ranges::any_of(instances,
                                   [&](const auto& i) { return from <= i.first && i.first <= to; });
      };
      const auto ends = [from, to](const auto& instances) {
        return std::ranges::any_of(
            instances, [&](const auto& i) { return from <= i.second && i.second <= to; });
      };
      const bool has_both = (starts(plan) || starts(fusion)) && (ends(plan) || ends(fusion));
      for (const auto& rule : verified.result.verdicts.rules) {
        EXPECT_NE(rule.verdict, Verdict::fail) << where << ' ' << rule.id;
        if (!has_both) continue;
        if (rule.id == "Q2") continue;  // a bound of which the part has no instance is unknown
        for (const auto& subject : rule.subjects) {
          EXPECT_NE(subject.verdict, Verdict::inconclusive)
              << where << ' ' << rule.id << ' ' << subject.subject << '\n'
              << verified.evidence(rule.id, subject.subject);
        }
      }
      if (!has_both) {
        EXPECT_EQ(verified["T5"], Verdict::inconclusive) << where << ": nothing passes vacuously";
      }
    }
  }
}

TEST(Window, JudgesWhatLiesInItAlone) {
  // Late in the first period, a skipped period before the third, an overlap in the fourth.
  constexpr const char* kTrace = R"(
    callback plan timer period=20
    11 start plan release=10
    29 end plan
    31 start plan release=30
    33 end plan
    71 start plan release=70 missed=1
    73 end plan
    91 start plan release=90
    93 end plan)";
  constexpr const char* kSpec = "callback_groups:\n  - {id: plan, response_deadline: 10}\n";
  const auto verdicts = [&](std::int64_t from, std::int64_t to) {
    const auto verified = in_window(kTrace, from, to, kSpec);
    return std::pair(verified.of("R3", "callback plan"), verified.of("R2", "callback plan"));
  };
  EXPECT_EQ(verdicts(0, 100), std::pair(Verdict::fail, Verdict::fail));
  EXPECT_EQ(verdicts(0, 50), std::pair(Verdict::fail, Verdict::pass));
  EXPECT_EQ(verdicts(30, 50), std::pair(Verdict::pass, Verdict::pass));
  EXPECT_EQ(verdicts(30, 100), std::pair(Verdict::pass, Verdict::fail));
  EXPECT_EQ(verdicts(80, 100), std::pair(Verdict::pass, Verdict::pass));
}

TEST(Window, ItsEdgesBelongToIt) {
  constexpr const char* kTrace = "callback a\n 10 start a\n 20 end a\n 30 start a\n 40 end a";
  EXPECT_EQ(callback(in_window(kTrace, 10, 20), "a").instances, 1U);
  EXPECT_EQ(callback(in_window(kTrace, 11, 20), "a").instances, 0U);
  EXPECT_EQ(callback(in_window(kTrace, 10, 19), "a").instances, 0U);
  const auto report = in_window(kTrace, 10, 20).result.report;
  EXPECT_EQ(report.trace.begin, Timestamp{10});
  EXPECT_EQ(report.trace.end, Timestamp{20});
}

TEST(Window, WhatAnEdgeCutsIsNoLoss) {
  // Instance 0 is cut by the begin, 2 by the end; 3 never ends.
  constexpr const char* kTrace = R"(
    callback a
    10 start a
    20 end a
    30 start a
    40 end a
    50 start a
    60 end a
    70 start a)";
  const auto verified = in_window(kTrace, 15, 55);
  EXPECT_EQ(callback(verified, "a").instances, 1U);
  EXPECT_EQ(callback(verified, "a").incomplete, 0U);
  EXPECT_EQ(callback(verified, "a").cut, 2U);
  EXPECT_EQ(callback(verified, "a").runs_not_seen, 2U) << "0, which began before, and 3";
  EXPECT_EQ(verified.of("E1", "callback a"), Verdict::pass)
      << verified.evidence("E1", "callback a");
  EXPECT_EQ(verified["T3"], Verdict::pass);
  EXPECT_EQ(verified["T4"], Verdict::pass) << verified.evidence("T4", "process 100");
  EXPECT_EQ(Verified(kTrace)["E1"], Verdict::fail) << "judged as a whole it is a violation";
}

TEST(Window, AnInstanceThatLastsLongerIsCutByBothEdges) {
  constexpr const char* kTrace = R"(
    callback a
    10 start a
    50 end a
    60 start a
    90 end a)";
  const auto inside = callback(in_window(kTrace, 20, 40), "a");
  EXPECT_EQ(inside.instances, 0U);
  EXPECT_EQ(inside.cut, 1U);
  EXPECT_EQ(callback(in_window(kTrace, 51, 59), "a").cut, 0U) << "between the two";
  EXPECT_EQ(callback(in_window(kTrace, 20, 70), "a").cut, 2U) << "one by each edge";
}

TEST(Window, TellsHowLongBeforeItsEndWhatIsOpenBegan) {
  constexpr const char* kTrace = R"(
    callback a
    10 start a
    20 end a
    30 start a)";
  const auto open = callback(in_window(kTrace, 0, 35), "a").longest_open;
  ASSERT_TRUE(open);
  EXPECT_EQ(open->seq, 1U);
  EXPECT_EQ(open->until_end, Duration{35 - 30});
  EXPECT_FALSE(callback(in_window(kTrace, 0, 25), "a").longest_open);
}

TEST(Window, WhatAProcessLeftOpenBeforeTheWindowIsNotCutByIt) {
  constexpr const char* kTrace = R"(
    process short until=20 crash
    callback a
    process long pid=200
    callback b
    10 start a
    30 start b
    60 end b)";
  EXPECT_EQ(callback(in_window(kTrace, 40, 70), "a").cut, 0U);
  EXPECT_EQ(callback(in_window(kTrace, 40, 70), "b").cut, 1U);
}

TEST(Window, LossOutsideIsNoneInsideIs) {
  auto trace = trace_of(R"(
    callback a subscription
    10 start a release=10
    12 end a
    20 start a release=20
    22 end a
    30 start a release=30
    32 end a
    40 start a release=40
    42 end a
    50 start a release=50
    52 end a
    60 start a release=60
    62 end a
    70 start a release=70
    72 end a)");
  const auto lose = [&trace](std::uint64_t seq) {
    trace.erase<CallbackStart>([seq](const auto& e, const EventHead&) { return e.seq == seq; });
    trace.erase<CallbackEnd>([seq](const auto& e, const EventHead&) { return e.seq == seq; });
  };
  const auto overall = [&trace](std::int64_t from, std::int64_t to) {
    return Verified(trace, {}, window(from, to)).result.verdicts.verdict;
  };
  EXPECT_EQ(overall(15, 65), Verdict::pass);
  lose(1);  // of 20
  EXPECT_EQ(overall(35, 65), Verdict::pass) << "2 was seen at 30";
  EXPECT_EQ(overall(25, 65), Verdict::inconclusive) << "1 may have run between 25 and 30";
  EXPECT_EQ(overall(15, 65), Verdict::inconclusive);
  lose(5);  // of 60
  EXPECT_EQ(overall(35, 45), Verdict::pass) << "4 was seen at 50";
  EXPECT_EQ(overall(35, 55), Verdict::inconclusive) << "5 may have run between 50 and 55";
}

TEST(Window, DiscardedEventsElsewhereDoNotMatter) {
  constexpr const char* kTrace = R"(
    callback a
    10 start a
    12 end a
    20 discard user until=25 count=7
    30 start a
    32 end a)";
  auto options = window(28, 40);
  options.require_lossless = true;
  EXPECT_EQ(Verified(trace_of(kTrace), {}, options)["T2"], Verdict::pass);
  options.window->from = {25};
  EXPECT_EQ(Verified(trace_of(kTrace), {}, options)["T2"], Verdict::fail);
  options.window = TimeWindow{.from = {0}, .to = {19}};
  EXPECT_EQ(Verified(trace_of(kTrace), {}, options)["T2"], Verdict::pass);
}

TEST(Window, StateFromBeforeHoldsInIt) {
  constexpr const char* kTrace = R"(
    callback plan timer period=20
    -50 initial plan
    -40 applied plan policy=fifo priority=80
    11 start plan release=10
    12 end plan
    31 start plan release=30
    32 end plan
    33 audit plan policy=fifo priority=80
    51 start plan release=50
    52 end plan
    53 audit plan policy=fifo priority=10
    71 start plan release=70
    72 end plan)";
  constexpr const char* kSpec =
      "callback_groups:\n  - {id: plan, policy: SCHED_FIFO, priority: 80}\n";
  const auto early = in_window(kTrace, 25, 40, kSpec);
  EXPECT_EQ(early.of("S1", "callback plan"), Verdict::pass) << "applied long before";
  EXPECT_EQ(early["S3"], Verdict::pass)
      << "the change comes later: " << early.evidence("S3", "thread 1");
  EXPECT_EQ(early["S2"], Verdict::not_applicable) << "the first instance lies before";
  EXPECT_EQ(in_window(kTrace, 45, 60, kSpec)["S3"], Verdict::fail);
  EXPECT_EQ(in_window(kTrace, 5, 30, kSpec)["S3"], Verdict::pass) << "an audit after it agrees";
  EXPECT_EQ(in_window(kTrace, 35, 45, kSpec)["S3"], Verdict::inconclusive)
      << "one after it does not, but that is no violation in it";
  EXPECT_EQ(in_window(kTrace, 60, 80, kSpec)["S3"], Verdict::inconclusive)
      << "the thread was changed before, but nothing in the window shows what it runs as";
}

// Where state from before holds, what may have hidden some of it counts, too.
TEST(Window, StateThatWasLostBeforeIsUnknownInIt) {
  constexpr const char* kSpec =
      "callback_groups:\n  - {id: plan, policy: SCHED_FIFO, priority: 80}\n";
  const auto judged = [](const std::string& first, const std::string& second) {
    return in_window(R"(
    process app crash
    callback plan timer period=20
    -50 initial plan
    -40 applied plan )" + first +
                         R"(
    11 start plan release=10
    12 end plan
    )" + second + R"(
    31 start plan release=30
    32 end plan
    51 start plan release=50
    52 end plan)",
                     40, 60, kSpec)
        .of("S1", "callback plan");
  };
  constexpr auto kFifo = "policy=fifo priority=80";
  constexpr auto kHole = "20 discard user until=25 count=1";
  EXPECT_EQ(judged(kFifo, ""), Verdict::pass);
  EXPECT_EQ(judged("nice=0", ""), Verdict::fail);
  EXPECT_EQ(judged(kFifo, kHole), Verdict::inconclusive) << "another one may have been applied";
  EXPECT_EQ(judged("nice=0", kHole), Verdict::inconclusive);
  EXPECT_EQ(judged(kFifo, std::string(kHole) + "\n26 applied plan " + kFifo), Verdict::pass);
}

TEST(Window, APriorityWhoseBoostMayBeLostBeforeItIsNoWitness) {
  const auto judged = [](const char* hole) {
    return in_window(std::string(R"(
    callback plan timer period=20
    -50 initial plan
    -40 applied plan policy=fifo priority=80
    2 switch 0 idle plan next_prio=19
    3 switch 0 plan idle state=1 prio=19
    )") + hole + R"(
    31 start plan release=30
    32 end plan
    50 switch 0 idle plan next_prio=9
    51 start plan release=50
    52 end plan)",
                     40, 60)["S3"];
  };
  EXPECT_EQ(judged(""), Verdict::fail);
  EXPECT_NE(judged("20 discard kernel until=25 count=1"), Verdict::fail);
}

TEST(Window, AnInstanceThatNeverEndedBeforeItIsNoneOfItsConcern) {
  constexpr const char* kTrace = R"(
    thread t1 pool
    thread t2 pool
    callback plan pooled
    10 start plan on=t1 seq=0
    20 start plan on=t2 seq=1
    22 end plan on=t2 seq=1
    50 start plan on=t2 seq=2
    52 end plan on=t2 seq=2)";
  EXPECT_EQ(Verified(kTrace)["E1"], Verdict::fail);
  EXPECT_EQ(in_window(kTrace, 5, 60)["E1"], Verdict::fail);
  EXPECT_EQ(in_window(kTrace, 40, 60)["E1"], Verdict::pass);
  EXPECT_EQ(in_window(kTrace, 40, 60)["T4"], Verdict::pass);
}

TEST(Window, ASecondEndOutsideItIsNoneOfItsConcern) {
  constexpr const char* kTwice = R"(
    callback plan timer period=20
    10 start plan release=10
    12 end plan
    13 end plan seq=0
    30 start plan release=30
    32 end plan
    50 start plan release=50
    52 end plan
    71 end plan seq=1)";
  EXPECT_EQ(in_window(kTwice, 0, 20)["E1"], Verdict::fail);
  EXPECT_EQ(in_window(kTwice, 20, 40)["E1"], Verdict::pass);
  EXPECT_EQ(in_window(kTwice, 20, 60)["E1"], Verdict::pass);
  EXPECT_EQ(in_window(kTwice, 20, 80)["E1"], Verdict::fail);
  EXPECT_EQ(in_window(kTwice, 40, 60)["E1"], Verdict::pass);
}

// Nor does it stand for the end of one that never ended.
TEST(Window, ASecondEndOutsideItHidesNoInstanceThatNeverEnded) {
  const auto trace = [](const std::string& twice) {
    return "callback plan timer period=20\n10 start plan release=10\n12 end plan\n" + twice +
           " end plan seq=0\n30 start plan release=30\n";
  };
  for (const auto* time : {"13", "71"}) {
    const auto verified = in_window(trace(time) + "80 fini plan", 20, 40);
    EXPECT_EQ(verified["E1"], Verdict::fail) << time;
    EXPECT_THAT(verified.evidence("E1", "callback plan"),
                HasSubstr("30 callback_start seq 1 starts and never ends"))
        << time;
  }
  // One that began before the window and that the other one's second end did not end.
  constexpr const char* kOpen = R"(
    callback plan timer period=20
    thread other pool
    10 start plan release=10
    12 start plan release=12 on=other
    14 end plan seq=0
    15 end plan seq=0
    18 end plan seq=1 on=other
    30 start plan release=30
    32 end plan)";
  EXPECT_EQ(callback(in_window(kOpen, 16, 40), "plan").instances, 1U);
  EXPECT_EQ(in_window(kOpen, 16, 40)["E1"], Verdict::pass);
}

// Even if the recording lacks its start, wherever the second end is told.
TEST(Window, ASecondEndOutsideItOfALostStartIsNoneOfItsConcern) {
  constexpr const char* kTwice = R"(
    callback plan timer period=20
    callback other timer period=20
    10 start plan release=10
    12 end plan
    13 end plan seq=0
    30 start plan release=30
    32 end plan
    34 start other release=34
    36 end other
    50 start plan release=50
    52 end plan)";
  const auto judged = [](std::string_view text, std::int64_t from, std::int64_t to) {
    auto trace = trace_of(text);
    trace.erase<CallbackStart>(
        [](const auto&, const EventHead& head) { return head.time.ns == 10; });
    return Verified(trace, {}, window(from, to));
  };
  EXPECT_EQ(judged(kTwice, 20, 40)["E1"], Verdict::inconclusive) << "seq 0 may have run in it";
  EXPECT_EQ(judged(kTwice, 35, 60)["E1"], Verdict::pass);
  // What ends first or again in the window began before it.
  auto elsewhere = std::string(kTwice);
  elsewhere.insert(elsewhere.find("seq=0") + 5, " on=other");
  for (const auto* rule : {"M2", "M3"}) {
    EXPECT_EQ(in_window(elsewhere, 11, 60)[rule], Verdict::pass) << rule;
    EXPECT_EQ(judged(elsewhere, 11, 60)[rule], Verdict::inconclusive) << rule;
  }
}

// Nor is one in it that ended before.
TEST(Window, ASecondEndInItCountsThoughItsInstanceEndedBefore) {
  constexpr const char* kTwice = R"(
    callback plan timer period=20
    10 start plan release=10
    12 end plan
    21 end plan seq=0
    30 start plan release=30
    32 end plan)";
  EXPECT_EQ(in_window(kTwice, 20, 40)["E1"], Verdict::fail);
}

TEST(Window, ThreadsOfLaterAreCountedThoughTheyHaveOneTid) {
  constexpr const char* kTrace = R"(
    callback plan timer period=20
    thread first worker tid=150
    thread second worker tid=150
    11 start plan release=10
    12 end plan
    50 begin first
    55 finish first
    60 begin second
    65 finish second)";
  EXPECT_EQ(Verified(kTrace)["T4"], Verdict::pass);
  EXPECT_EQ(in_window(kTrace, 5, 40)["T4"], Verdict::pass);
}

TEST(Window, RunningTotalsCountFromItsBegin) {
  constexpr const char* kTrace = R"(
    callback a subscription
    10 release a overwritten=3
    11 start a
    12 end a
    15 lost a count=2
    20 release a overwritten=3
    21 start a
    22 end a
    30 release a overwritten=5
    31 start a
    32 end a
    35 lost a count=1)";
  EXPECT_EQ(in_window(kTrace, 18, 25)["Q1"], Verdict::pass);
  const auto late = in_window(kTrace, 28, 40);
  EXPECT_EQ(late["Q1"], Verdict::fail);
  EXPECT_THAT(late.evidence("Q1", "callback a"), HasSubstr("1 sample was lost"));
  EXPECT_THAT(late.evidence("Q1", "callback a"), HasSubstr("2 samples were overwritten"));
  EXPECT_EQ(in_window(kTrace, 5, 14)["Q1"], Verdict::fail) << "three were overwritten by then";
}

TEST(Window, ACallbackOfTheSpecMayHaveRunOutside) {
  constexpr const char* kTrace = R"(
    callback often
    callback seldom
    5 start seldom
    6 end seldom
    10 start often
    12 end often)";
  constexpr const char* kSpec =
      "callback_groups:\n  - {id: seldom}\n  - {id: often}\n  - {id: none}\n";
  const auto verified = in_window(kTrace, 8, 20, kSpec);
  EXPECT_EQ(verified.of("M1", "callback seldom"), Verdict::pass);
  EXPECT_EQ(verified.of("M1", "callback often"), Verdict::pass);
  EXPECT_EQ(verified.of("M1", "callback none"), Verdict::fail);
}

TEST(Window, WithoutAnyStartNothingPasses) {
  const auto verified = in_window("callback a\n 10 start a\n 12 end a", 20, 30);
  EXPECT_EQ(verified.result.verdicts.verdict, Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"), HasSubstr(" in the window; widen --window"));
  EXPECT_THAT(verified.evidence("M2", "trace"), HasSubstr("no callback started in the window"));
}

TEST(Window, AProcessThatOutlivesItWasNotInterrupted) {
  constexpr const char* kTrace = R"(
    process app crash
    callback a
    10 start a
    12 end a
    30 start a
    32 end a)";
  EXPECT_EQ(Verified(kTrace)["T4"], Verdict::inconclusive);
  EXPECT_EQ(in_window(kTrace, 5, 20)["T4"], Verdict::pass);
  EXPECT_EQ(in_window(kTrace, 25, 40)["T4"], Verdict::inconclusive);
}

TEST(Window, ThreadsAndCallbacksOfLaterAreNoneOfItsConcern) {
  constexpr const char* kTrace = R"(
    callback a subscription
    callback b subscription
    40 begin b
    41 initial b
    42 applied b
    41 init b
    10 start a release=10
    12 end a
    50 start b release=50
    52 end b)";
  const auto verified =
      in_window(kTrace, 5, 20, "callback_groups:\n  - {id: b, policy: SCHED_OTHER}\n");
  for (const auto& rule : verified.result.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      EXPECT_LE(subject.verdict, Verdict::pass)
          << rule.id << ' ' << verified.evidence(rule.id, subject.subject);
    }
  }
}

TEST(Window, WorkBeforeItIsNotForeignWorkInIt) {
  // Before the window the thread works outside callbacks for 8 of 10; in it for 1 of 20.
  constexpr const char* kTrace = R"(
    kernel
    callback a
    1 switch 0 idle a
    2 switch 0 a idle state=1
    2 switch 0 idle a
    10 switch 0 a idle state=1
    20 switch 0 idle a
    22 start a
    30 end a
    30 switch 0 a idle state=1
    40 switch 0 idle a
    42 start a
    50 end a
    51 switch 0 a idle state=1)";
  constexpr const char* kSpec = "callback_groups:\n  - {id: a, foreign_work_budget: 200000000}\n";
  EXPECT_EQ(in_window(kTrace, 0, 60, kSpec)["M6"], Verdict::fail);
  EXPECT_EQ(in_window(kTrace, 25, 49, kSpec)["M6"], Verdict::pass)
      << "from the wait at 30 within the cut instance: 2 of 19";
  EXPECT_EQ(in_window(kTrace, 15, 49, kSpec)["M6"], Verdict::pass)
      << "it waits when the window begins: 2 + 2 of 34";
  EXPECT_EQ(in_window(kTrace, 15, 22, kSpec)["M6"], Verdict::fail) << "2 of 7";
}

TEST(Window, WhoOnlyKeepsTheTimeIsNoProcessOfTheReport) {
  auto trace = trace_of("callback a\n 10 start a\n 12 end a\n 30 start a\n 32 end a");
  const EventHead head{.time = {5}, .stream = {}, .cpu = 0, .pid = 7, .tid = 8};
  const auto place = std::ranges::find_if(
      trace.events, [](const Event& event) { return event.head.time.ns >= 5; });
  trace.events.insert(place, Event{.head = head, .body = ClockSync{}});
  EXPECT_EQ(Verified(trace, {}, window(20, 40)).result.report.processes.size(), 1U);
}

TEST(Window, AllOfTheRecordingIsWhatThereIsWithout) {
  const auto whole = Verified(trace_of(kSound), kSoundSpec);
  const auto wide = in_window(kSound, -1'000'000, 1'000'000, kSoundSpec);
  for (std::size_t i = 0; i < whole.result.verdicts.rules.size(); ++i) {
    EXPECT_EQ(whole.result.verdicts.rules[i].verdict, wide.result.verdicts.rules[i].verdict) << i;
  }
  EXPECT_EQ(whole.result.report.trace.begin, wide.result.report.trace.begin);
  EXPECT_EQ(whole.result.report.trace.end, wide.result.report.trace.end);
  EXPECT_EQ(whole.result.report.trace.events, wide.result.report.trace.events);
}

// Without the releases nobody knows when the three samples were overwritten.
TEST(WindowOfAQueue, KnowsNoTotalsThatOnlyTheEndTells) {
  auto trace = trace_of(R"(
    callback fusion subscription topic=/a
    5 release fusion
    10 start fusion
    12 end fusion
    25 release fusion overwritten=3
    30 start fusion
    32 end fusion
    35 lost fusion count=2)");
  const auto q1 = [&trace](std::int64_t from, std::int64_t to) {
    return Verified(trace, {}, window(from, to))["Q1"];
  };
  EXPECT_EQ(q1(0, 20), Verdict::pass);
  EXPECT_EQ(q1(20, 33), Verdict::fail);
  trace.erase<CallbackRelease>();
  trace.erase<SampleLost>();
  EXPECT_EQ(Verified(trace)["Q1"], Verdict::fail);
  EXPECT_EQ(q1(0, 20), Verdict::inconclusive);
  EXPECT_EQ(q1(20, 33), Verdict::inconclusive);
}

// Containers count their processes from 1, each of them.
TEST(WindowOfTwoHosts, TellsTheirThreadsApart) {
  const std::string app =
      "callback fusion\n1 initial fusion\n2 applied fusion\n10 start fusion\n12 end fusion\n";
  const auto robot = trace_of(app + "50 audit fusion");
  const auto desk = trace_of(app + "30 audit fusion\n50 audit fusion");
  const Verified verified(beside(robot, desk, {.name = "desk"}), {}, window(0, 40));
  EXPECT_EQ(verified["T4"], Verdict::pass);
}

}  // namespace
}  // namespace cie::test
