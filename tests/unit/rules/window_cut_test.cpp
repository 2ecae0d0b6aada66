// `--window`: a part of a recording is judged as if the rest were sound, and by what the rest
// knows.
#include "support/move_to_host.hpp"
#include "windows.hpp"

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
  EXPECT_EQ(callback(verified, "a").runs_not_seen, 1U) << "3; 0 is cut";
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

// Two samples were lost at 25, one at 65; of them the first event is missing, and its loss may be told.
TEST(WindowOfAQueue, IsBlamedForNothingThatMayHaveBeenLostOutsideIt) {
  auto trace = trace_of(R"(
    callback fusion subscription topic=/a
    10 release fusion
    11 start fusion
    12 end fusion
    25 lost fusion count=2
    40 release fusion
    41 start fusion
    42 end fusion
    65 lost fusion count=1
    70 release fusion
    71 start fusion
    72 end fusion)");
  const auto judged = [&trace](std::int64_t from, std::int64_t to) {
    return Verified(trace, {}, window(from, to));
  };
  const auto q1 = [&judged](std::int64_t from, std::int64_t to) { return judged(from, to)["Q1"]; };
  EXPECT_EQ(q1(0, 20), Verdict::pass);
  EXPECT_EQ(q1(30, 50), Verdict::pass);
  trace.erase<SampleLost>([](const auto&, const EventHead& head) { return head.time.ns == 25; });
  EXPECT_EQ(q1(0, 20), Verdict::inconclusive);
  EXPECT_EQ(q1(30, 50), Verdict::inconclusive);
  EXPECT_EQ(q1(68, 80), Verdict::pass) << "three had been lost at 65";
  EXPECT_THAT(judged(60, 80).evidence("Q1", "callback fusion"), HasSubstr("1 sample was lost"));
}

// The release at 30 overwrites a sample.
TEST(WindowOfAQueue, KnowsNotWhichOfTheMissingReleasesOverwroteASample) {
  constexpr const char* kTrace = R"(
    callback fusion subscription topic=/a
    10 release fusion
    11 start fusion
    12 end fusion
    30 release fusion overwritten=1
    50 release fusion overwritten=1
    51 start fusion
    52 end fusion
    70 release fusion overwritten=1
    71 start fusion
    72 end fusion)";
  const auto q1_without = [](std::int64_t lost_from, std::int64_t lost_to, std::int64_t from,
                             std::int64_t to) {
    auto trace = trace_of(kTrace);
    trace.erase<CallbackRelease>([=](const auto&, const EventHead& head) {
      return lost_from <= head.time.ns && head.time.ns <= lost_to;
    });
    return Verified(trace, {}, window(from, to))["Q1"];
  };
  EXPECT_EQ(q1_without(0, 0, 5, 20), Verdict::pass);
  EXPECT_EQ(q1_without(0, 0, 20, 40), Verdict::fail);
  EXPECT_EQ(q1_without(0, 0, 40, 60), Verdict::pass);
  EXPECT_EQ(q1_without(30, 30, 40, 60), Verdict::inconclusive) << "or the one at 50 did";
  EXPECT_EQ(q1_without(30, 30, 40, 100), Verdict::inconclusive);
  EXPECT_EQ(q1_without(30, 30, 20, 60), Verdict::inconclusive) << "or it did before 20";
  EXPECT_EQ(q1_without(30, 30, 5, 60), Verdict::fail) << "one of the two";
  EXPECT_EQ(q1_without(30, 30, 60, 100), Verdict::pass) << "1 by 50";
  EXPECT_EQ(q1_without(30, 50, 20, 60), Verdict::inconclusive) << "or the one at 70 did";
  EXPECT_EQ(q1_without(30, 70, 20, 60), Verdict::inconclusive) << "the end alone tells";
}

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
