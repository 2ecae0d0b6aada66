// Whether a callback had a thread of its own: it had, it had not, it never ran, or nobody knows.
#include <cie/analysis/analyzer.hpp>

#include "support/trace_text.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

std::map<std::string, std::optional<Isolation>> isolation_of(const TextTrace& trace) {
  std::map<std::string, std::optional<Isolation>> isolation;
  for (const auto& callback : analyze(trace).report.callbacks)
    isolation[callback.logical_id] = callback.isolation;
  return isolation;
}

constexpr const char* kThree = R"(
  callback alone timer
  callback idle service
  callback first timer pooled
  callback second timer pooled
  thread pool pool
  10 start alone release=10
  12 end alone
  20 start first on=pool release=20
  22 end first on=pool
  30 start second on=pool release=30
  32 end second on=pool)";

TEST(Isolation, OfWhatNeverRanIsNeitherKeptNorBroken) {
  auto isolation = isolation_of(trace_of(kThree));
  EXPECT_EQ(isolation["alone"], Isolation::isolated);
  EXPECT_EQ(isolation["idle"], Isolation::never_ran);
  EXPECT_EQ(isolation["first"], Isolation::not_isolated);
  EXPECT_EQ(isolation["second"], Isolation::not_isolated);
}

TEST(Isolation, IsBrokenByASecondThread) {
  auto isolation = isolation_of(trace_of(R"(
    callback first timer
    thread other pool
    20 start first release=20
    22 end first
    30 start first on=other release=30
    32 end first on=other)"));
  EXPECT_EQ(isolation["first"], Isolation::not_isolated);
}

// As where an executor spins again: M2, M3 and M4 pass.
constexpr const char* kSpunTwice = R"(
  callback first timer pooled
  thread t1 callback of=first tid=101
  thread t2 callback of=first tid=102
  -500 begin t1
  10 start first on=t1 release=10
  12 end first on=t1
  14 finish t1
  20 begin t2
  30 start first on=t2 release=30
  32 end first on=t2
  34 finish t2)";

TEST(Isolation, IsKeptByAThreadThatReplacesAnotherWithANewRegistration) {
  const std::string again = "\n22 init first";
  EXPECT_EQ(isolation_of(trace_of(kSpunTwice + again))["first"], Isolation::isolated);
  EXPECT_EQ(isolation_of(trace_of(kSpunTwice))["first"], Isolation::not_isolated);
  const auto shared = again + R"(
    callback other timer pooled
    24 start other on=t2 release=24
    26 end other on=t2)";
  EXPECT_EQ(isolation_of(trace_of(kSpunTwice + shared))["first"], Isolation::not_isolated);
}

TEST(Isolation, IsNotKnownWhereTheEndOfTheFormerThreadWasLost) {
  auto trace = trace_of(std::string(kSpunTwice) + "\n22 init first");
  trace.erase<ThreadFini>([](const ThreadFini& e, const EventHead&) { return e.tid == 101; });
  EXPECT_EQ(isolation_of(trace)["first"], std::nullopt);
}

// The totals of a process that exit() ended come before its last instance.
TEST(Isolation, IsNotKnownOfWhatGoesOnAfterAThreadsEnd) {
  auto trace = trace_of(R"(
    callback first timer pooled
    thread t1 callback of=first tid=101
    10 start first on=t1
    12 end first on=t1
    14 finish t1
    30 start first on=t1
    32 end first on=t1)");
  EXPECT_EQ(isolation_of(trace)["first"], Isolation::not_isolated);
  trace.erase<RunEnd>();
  EXPECT_EQ(isolation_of(trace)["first"], std::nullopt);
}

// An instance that was open when the recording ended ran, though no table counts it.
TEST(Isolation, IsKnownOfWhatOnlyBegan) {
  auto isolation = isolation_of(trace_of(R"(
    process app crash
    callback first timer
    20 start first release=20)"));
  EXPECT_EQ(isolation["first"], Isolation::isolated);
}

// Whoever is attached later sees no run of what ran before.
TEST(Isolation, OfWhatRanUnseenIsNotThatOfWhatNeverRan) {
  const auto report = analyze(trace_of(R"(
    process app attached
    callback before next=50
    callback never
    callback now next=7
    20 start now
    22 end now)"))
                          .report;
  const auto runs_not_seen = [&report](std::string_view id) {
    return std::ranges::find(report.callbacks, id, &CallbackReport::logical_id)->runs_not_seen;
  };
  EXPECT_EQ(runs_not_seen("before"), 50U);
  EXPECT_EQ(runs_not_seen("never"), 0U);
  EXPECT_EQ(runs_not_seen("now"), 7U);
}

// No total tells of a process that was killed.
TEST(Isolation, NumbersProveRunsBetweenOthers) {
  const auto report = analyze(trace_of(R"(
    process app crash
    callback first
    20 start first seq=0
    22 end first seq=0
    50 start first seq=3
    52 end first seq=3)"))
                          .report;
  EXPECT_EQ(report.callbacks.at(0).instances, 2U);
  EXPECT_EQ(report.callbacks.at(0).runs_not_seen, 2U) << "1 and 2";
}

TEST(Isolation, IsNotKnownOfRunsWithoutAThread) {
  auto trace = trace_of(kThree);
  for (auto& event : trace.events) {
    const bool is_run = std::holds_alternative<CallbackStart>(event.body) ||
                        std::holds_alternative<CallbackEnd>(event.body);
    if (is_run && event.head.time.ns < 15) event.head.tid.reset();  // those of `alone`
  }
  auto isolation = isolation_of(trace);
  EXPECT_EQ(isolation["alone"], std::nullopt);
  EXPECT_EQ(isolation["idle"], Isolation::never_ran);
  EXPECT_EQ(isolation["first"], Isolation::not_isolated);
}

}  // namespace
}  // namespace cie::test
