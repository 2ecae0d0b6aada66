// `--window`: instances that ended outside it, twice, or never.
#include "windows.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

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

// Its message is known, and so is that the chain began before: as where it was published before, too.
TEST(Window, WhatAnInstancePublishesThatItsBeginCutsIsOfNoChain) {
  constexpr const char* kTrace = R"(
    publisher out topic=/t
    callback plan timer period=20
    callback fusion topic=/t
    11 start plan release=10
    13 publish out on=plan
    15 end plan
    16 release fusion
    17 start fusion from=out:0
    19 end fusion
    31 start plan release=30
    33 publish out on=plan
    35 end plan
    36 release fusion
    37 start fusion from=out:1
    39 end fusion)";
  constexpr auto kSpec = "chains:\n  - {name: brake, callbacks: [plan, fusion], path_latency: 9}\n";
  for (const auto from : {5, 12, 14, 16}) {
    const auto part = in_window(kTrace, from, 50, kSpec);
    EXPECT_EQ(part["Q2"], Verdict::pass) << from << '\n' << part.evidence("Q2", "chain brake");
    EXPECT_EQ(part.result.report.chains.at(0).instances, from == 5 ? 2U : 1U) << from;
  }
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

// A tracer that records one event twice: the program's totals count it once.
TEST(Window, IsNotLackingAnEndWhereOneOutsideWasRecordedTwice) {
  auto trace = trace_of(R"(
    callback a timer period=20
    10 start a release=10
    12 end a
    30 start a release=30
    32 end a
    50 start a release=50
    52 end a)");
  const auto first = std::ranges::find_if(trace.events, [](const Event& event) {
    return std::holds_alternative<CallbackEnd>(event.body);
  });
  auto again = *first;
  ++again.head.time.ns;
  trace.events.insert(std::next(first), again);
  constexpr const char* kSpec = "callback_groups:\n  - {id: a, response_deadline: 5}\n";
  const Verified verified(trace, kSpec, window(20, 100));
  EXPECT_EQ(verified["E1"], Verdict::pass);
  EXPECT_EQ(verified["R3"], Verdict::pass);
  EXPECT_EQ(Verified(trace, kSpec, window(5, 100))["E1"], Verdict::fail) << "it ends twice in it";
}

}  // namespace
}  // namespace cie::test
