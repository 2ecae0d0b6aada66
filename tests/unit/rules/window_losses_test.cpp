// `--window`: what was lost inside it and outside, and what state from before it holds.
#include "windows.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

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

TEST(Window, WhatIsMissingUpToTheFirstNumberAfterItMayLieInIt) {
  for (const auto* process : {"process app crash", "process app"}) {
    auto trace = trace_of(std::string(process) + R"(
    callback plan timer period=20
    callback other timer period=20
    publisher out
    10 start plan release=10
    11 publish out on=plan
    12 end plan
    15 start other release=10
    16 end other
    30 start plan release=30
    31 publish out on=plan
    32 end plan
    35 start other release=30
    36 end other
    50 start plan release=50
    51 publish out on=plan
    52 end plan
    55 start other release=50
    56 end other)");
    trace.erase<CallbackStart>(
        [](const auto&, const EventHead& head) { return head.time.ns == 30; });
    trace.erase<CallbackEnd>([](const auto&, const EventHead& head) { return head.time.ns == 32; });
    trace.erase<Publish>([](const auto&, const EventHead& head) { return head.time.ns == 31; });
    const auto judged = [&trace](std::int64_t from, std::int64_t to) {
      return Verified(trace, {}, window(from, to));
    };
    for (const std::int64_t from : {5, 14, 33}) {
      const auto verified = judged(from, 40);
      EXPECT_EQ(verified.of("T3", "callback plan"), Verdict::inconclusive) << process << from;
      EXPECT_EQ(verified.of("T3", "topic /out"), Verdict::inconclusive) << process << from;
      EXPECT_NE(verified.of("E1", "callback plan"), Verdict::pass) << process << from;
      EXPECT_EQ(verified.of("E1", "callback other"), Verdict::pass) << process << from;
    }
    EXPECT_EQ(judged(5, 40).of("M3", "callback plan"), Verdict::inconclusive) << process;
    EXPECT_EQ(judged(5, 40).evidence("T3", "callback plan"),
              "50 callback_start seq jumps: 1 was next and 2 came; 1 missing in all\n");
  }
}

TEST(Window, WhatIsPromisedAfterItIsMissingAfterIt) {
  auto trace = trace_of(R"(
    process first until=30 crash
    callback a
    process second pid=200 from=40 crash
    callback b
    10 start a
    12 end a
    50 start b
    52 end b
    60 start b
    62 end b)");
  trace.erase<CallbackStart>([](const auto&, const EventHead& head) { return head.time.ns == 50; });
  trace.erase<CallbackEnd>([](const auto&, const EventHead& head) { return head.time.ns == 52; });
  EXPECT_EQ(Verified(trace)["T3"], Verdict::inconclusive);
  EXPECT_EQ(Verified(trace, {}, window(5, 30))["T3"], Verdict::pass);
}

TEST(Window, AReadBackMissingUpToTheFirstOneAfterItMayLieInIt) {
  for (const auto* process : {"process app crash", "process app"}) {
    auto trace = trace_of(std::string(process) + R"(
    callback plan timer period=20
    -50 initial plan
    -40 applied plan policy=fifo priority=80
    11 start plan release=10
    12 end plan
    13 audit plan policy=fifo priority=80
    31 start plan release=30
    32 end plan
    33 audit plan policy=fifo priority=10
    51 start plan release=50
    52 end plan
    53 audit plan policy=fifo priority=80)");
    const auto judged = [&trace](const char* rule, std::int64_t from, std::int64_t to) {
      return Verified(trace, {}, window(from, to)).of(rule, "thread 101");
    };
    EXPECT_EQ(judged("S3", 5, 40), Verdict::fail) << process;
    trace.erase<ThreadSched>([](const auto&, const EventHead& head) { return head.time.ns == 33; });
    for (const auto* rule : {"T3", "S3", "S4"}) {
      EXPECT_EQ(judged(rule, 5, 40), Verdict::inconclusive) << process << ' ' << rule;
      EXPECT_EQ(judged(rule, 30, 40), Verdict::inconclusive) << process << ' ' << rule;
    }
  }
}

// Between two sessions: the second one's announcement says what came until then.
TEST(Window, AnAnnouncementBeforeItSaysWhatIsNextInIt) {
  for (const auto* process : {"process app crash", "process app"}) {
    auto trace = trace_of(std::string(process) + R"(
    callback fusion subscription topic=/a
    5 release fusion
    10 start fusion
    12 end fusion
    25 release fusion
    30 start fusion
    32 end fusion
    40 init fusion
    45 release fusion
    50 start fusion
    52 end fusion)");
    trace.erase<CallbackRelease>(
        [](const auto&, const EventHead& head) { return head.time.ns == 25; });
    trace.erase<CallbackStart>(
        [](const auto&, const EventHead& head) { return head.time.ns == 30; });
    trace.erase<CallbackEnd>([](const auto&, const EventHead& head) { return head.time.ns == 32; });
    for (auto& event : trace.events) {
      auto* init = std::get_if<CallbackInit>(&event.body);
      if (init != nullptr && event.head.time.ns == 40) init->next_seq = 2;
    }
    const auto judged = [&trace](std::int64_t from) {
      return Verified(trace, {}, window(from, 55)).of("M3", "callback fusion");
    };
    EXPECT_EQ(judged(0), Verdict::inconclusive) << process;
    EXPECT_EQ(judged(35), Verdict::inconclusive) << process << ": or from then to 40";
    EXPECT_EQ(judged(42), Verdict::pass) << process;
  }
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
  EXPECT_EQ(judged("20 discard kernel until=25 count=1"), Verdict::inconclusive);
}

// What was overwritten before a recording was attached is in no window of it, as an announcement in
// one tells of no beginning.
TEST(Window, DoesNotCountWhatWasOverwrittenBeforeTheRecordingWasAttached) {
  constexpr const char* kTrace = R"(
    process app attached
    callback a subscription next=1
    5 release a overwritten=3
    6 start a
    7 end a
    20 release a overwritten=3
    21 start a
    22 end a
    40 fini a)";
  constexpr const char* kSpec = "callback_groups:\n  - {id: a, overwrites_allowed: 2}\n";
  auto trace = trace_of(kTrace);
  for (auto& event : trace.events) {
    if (std::holds_alternative<CallbackInit>(event.body)) event.head.time = Timestamp{10};
    if (auto* release = std::get_if<CallbackRelease>(&event.body)) release->release_seq += 4;
    if (auto* fini = std::get_if<CallbackFini>(&event.body)) fini->released += 4;
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  EXPECT_EQ(Verified(trace, kSpec)["Q1"], Verdict::fail) << "of its lifetime";
  for (const std::int64_t from : {0, 4}) {
    const Verified verified(trace, kSpec, window(from, 100));
    EXPECT_EQ(verified["Q1"], Verdict::inconclusive) << from;
    EXPECT_EQ(callback(verified, "a").overwritten_samples, std::nullopt) << from;
  }
  EXPECT_EQ(Verified(trace, kSpec, window(6, 100))["Q1"], Verdict::pass);
}

}  // namespace
}  // namespace cie::test
