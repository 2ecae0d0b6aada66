// What stays unknown of an instance, and of a message, where the end of an instance before was lost.
#include <cie/analysis/analyzer.hpp>

#include "support/trace_text.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

// waking_ns and wakeup_ns.
using Wakes = std::pair<std::optional<Timestamp>, std::optional<Timestamp>>;
const Wakes kUnknown{};

Wakes woken(std::int64_t waking, std::int64_t wakeup) {
  return {Timestamp{waking}, Timestamp{wakeup}};
}

// By start.
std::map<std::int64_t, Wakes> wakes_of(const TextTrace& trace) {
  struct : Observer {
    void on_instance(const Instance& instance) override {
      all[instance.start.ns] = {instance.waking, instance.wakeup};
    }
    std::map<std::int64_t, Wakes> all;
  } told;
  analyze(trace, {}, &told);
  return told.all;
}

template <typename Body>
void lose(TextTrace& trace, std::int64_t time) {
  EXPECT_EQ(trace.erase<Body>(
                [time](const auto&, const EventHead& head) { return head.time.ns == time; }),
            1U);
}

// As a reader does, before the packet whose events follow on the lost ones.
TextTrace with_losses_told_as_they_begin(TextTrace trace) {
  for (auto& event : trace.events) {
    if (const auto* loss = std::get_if<Discarded>(&event.body)) event.head.time = loss->begin;
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  return trace;
}

constexpr const char* kNoWait = R"(
  callback fusion waitable
  9  waking fusion
  10 wakeup fusion
  11 start  fusion release=none
  15 waking fusion                 # it had waited for a lock
  20 end    fusion
  21 start  fusion release=none    # was due already: the thread did not wait
  29 end    fusion)";

TEST(LostEnd, LeavesWhatWokeTheNextInstanceUnknown) {
  auto trace = trace_of(kNoWait);
  lose<CallbackEnd>(trace, 20);
  const auto wakes = wakes_of(trace);
  EXPECT_EQ(wakes.at(11), woken(9, 10));
  EXPECT_EQ(wakes.at(21), kUnknown);
}

TEST(LostEnd, LeavesItUnknownBehindACountedLossToo) {
  auto trace = trace_of(std::string(kNoWait) + "\n19 discard user until=21 count=1");
  lose<CallbackEnd>(trace, 20);
  EXPECT_EQ(wakes_of(trace).at(21), kUnknown);
}

// Its loop waits between two instances alone.
TEST(LostEnd, LiesBeforeAWakeUpThatTheExecutorTells) {
  auto trace = trace_of(std::string(kNoWait) + R"(
  39 waking fusion
  40 wakeup fusion
  41 start  fusion release=none
  45 end    fusion)");
  lose<CallbackEnd>(trace, 29);
  EXPECT_EQ(wakes_of(trace).at(41), woken(39, 40));
}

// The numbers of a callback do not show whether another one of its thread has ended.
TEST(LostEnd, OfAnotherCallbackLeavesItUnknownWhereEventsWereLost) {
  const auto wakes = [](const std::string& discard) {
    auto trace = with_losses_told_as_they_begin(trace_of(R"(
      thread t1 pool
      callback lidar waitable pooled
      callback fusion waitable pooled
      9  waking t1
      10 wakeup lidar on=t1
      11 start  lidar on=t1 release=none
      20 end    lidar on=t1
      29 waking t1
      30 wakeup fusion on=t1
      31 start  fusion on=t1 release=none
      35 end    fusion on=t1
    )" + discard));
    lose<CallbackEnd>(trace, 20);
    return wakes_of(trace).at(31);
  };
  EXPECT_EQ(wakes("15 discard user until=60 count=1"), kUnknown);
  EXPECT_EQ(wakes("15 discard user until=30 count=1"), (Wakes{std::nullopt, Timestamp{30}}))
      << "what is told next follows on what was lost";
  EXPECT_EQ(wakes("15 discard user until=28 count=1"), woken(29, 30));
}

// By definition the last wake-up since the thread's previous end, which lies before the outer one.
TEST(NestedInstance, HasWhatWokeItsThread) {
  const auto trace = trace_of(R"(
    thread t1 pool
    callback lidar waitable pooled
    callback fusion waitable pooled
    9  waking t1
    10 wakeup lidar on=t1
    11 start  lidar on=t1 release=none
    15 start  fusion on=t1 release=none
    16 end    fusion on=t1
    20 end    lidar on=t1)");
  EXPECT_EQ(wakes_of(trace).at(15), woken(9, 10));
}

// The first instance of plan publishes nothing. Its end and the second one's start are lost: the path
// from there takes 10, and from the first one it would take 30.
std::string lost_between(int second_end, const std::string& more) {
  return R"(
    publisher out topic=/points
    callback plan timer period=20
    callback fusion subscription topic=/points
    11 start plan release=10
    14 end plan
    31 start plan release=30
    33 publish out on=plan
    36 start fusion release=35 from=out:0
    40 end fusion
    71 start plan release=70
    73 publish out on=plan
    74 end plan
    76 start fusion release=75 from=out:1
    82 end fusion)"
         "\n" +
         std::to_string(second_end) + " end plan\n" + more;
}

void expect_the_last_path_alone(TextTrace trace) {
  lose<CallbackEnd>(trace, 14);
  lose<CallbackStart>(trace, 31);
  const auto report = analyze(trace).report;
  ASSERT_EQ(report.chains.size(), 1U);
  const auto& latency = report.chains.front().path_latency;
  ASSERT_TRUE(latency);
  EXPECT_EQ(latency->count, 1U);
  EXPECT_EQ(latency->max, 82 - 70);
  ASSERT_EQ(report.edges.size(), 1U);
  EXPECT_EQ(report.edges.front().messages, 1U);
}

// A packet ends with its last event, in whose nanosecond the loss behind it begins then. It ends, as far
// as is told, where the next packet does.
TEST(LostEnd, MayFollowAtOnceOnAStartThatAPacketEndsWith) {
  expect_the_last_path_alone(with_losses_told_as_they_begin(
      trace_of(lost_between(44, "11 discard user until=60 count=2"))));
}

TEST(LostEnd, ShownByTheNextOneCutsTheChainThere) {
  expect_the_last_path_alone(trace_of(lost_between(34, "")));
}

TEST(LostEnd, ShownByALaterStartCutsTheChainThere) {
  auto trace = trace_of(lost_between(34, "37 start plan release=37\n39 end plan"));
  lose<CallbackEnd>(trace, 34);
  expect_the_last_path_alone(std::move(trace));
}

// The chain instance has ended by then, at 40.
TEST(LostEnd, ShownAfterTheChainEndedCutsItThere) {
  expect_the_last_path_alone(trace_of(lost_between(44, "")));
}

TEST(LostEnd, ShownByAStartAfterTheChainEndedCutsItThere) {
  auto trace = trace_of(lost_between(44, "50 start plan release=50\n54 end plan"));
  lose<CallbackEnd>(trace, 44);
  expect_the_last_path_alone(std::move(trace));
}

// Nor does it hide in a callback between that and the chain's last one, or in later chain instances.
TEST(LostEnd, ShownLateCutsLongerChainsThere) {
  auto trace = trace_of(R"(
    publisher out topic=/points
    publisher on topic=/objects
    callback plan timer period=20
    callback fusion subscription topic=/points
    callback act subscription topic=/objects
    11 start plan release=10
    14 end plan
    31 start plan release=30
    33 publish out on=plan
    36 start fusion release=35 from=out:0
    38 publish on on=fusion
    40 end fusion
    41 start act release=40 from=on:0
    42 end act
    44 end plan
    71 start plan release=70
    73 publish out on=plan
    76 start fusion release=75 from=out:1
    78 publish on on=fusion
    79 end fusion
    81 start act release=80 from=on:1
    83 end act
    84 end plan)");
  lose<CallbackEnd>(trace, 14);
  lose<CallbackStart>(trace, 31);
  const auto report = analyze(trace).report;
  ASSERT_EQ(report.chains.size(), 1U);
  ASSERT_TRUE(report.chains.front().path_latency);
  EXPECT_EQ(report.chains.front().path_latency->count, 1U);
  EXPECT_EQ(report.chains.front().path_latency->max, 83 - 70);
}

// What ran last on the thread of an executor may be another callback.
TEST(LostEnd, ShownByTheEndOfAnotherCallbackCutsTheChainThere) {
  auto trace = trace_of(R"(
    thread t1 pool
    publisher out topic=/points
    callback lidar timer period=60 pooled
    callback plan timer period=60 pooled
    callback fusion subscription topic=/points
    11 start lidar on=t1 release=10
    14 end lidar on=t1
    31 start plan on=t1 release=30
    33 publish out on=t1
    34 end plan on=t1
    36 start fusion release=35 from=out:0
    40 end fusion
    71 start lidar on=t1 release=70
    74 end lidar on=t1)");
  lose<CallbackEnd>(trace, 14);
  lose<CallbackStart>(trace, 31);
  EXPECT_TRUE(analyze(trace).report.chains.empty());
}

// A callback that runs on publishes on. No more than 64 instances of each reader wait for its end.
TEST(LostEnd, IsNotWaitedForByMoreThanAFewOfEachReader) {
  constexpr int kMessages = 1000;
  std::string text = R"(
    publisher out topic=/points
    callback plan timer period=20
    callback fusion subscription topic=/points
    11 start plan release=10)";
  for (int i = 0; i < kMessages; ++i) {
    const auto time = 20 + 10 * i;
    text += "\n" + std::to_string(time) + " publish out on=plan\n" + std::to_string(time + 2) +
            " start fusion release=" + std::to_string(time + 1) + " from=out:" + std::to_string(i) +
            "\n" + std::to_string(time + 5) + " end fusion";
  }
  constexpr int kLastEnd = 20 + 10 * (kMessages - 1) + 5;
  const auto trace = trace_of(text + "\n" + std::to_string(kLastEnd + 1) + " end plan");
  const auto latency_of = [](const AnalysisResult& result) {
    return *result.report.chains.at(0).path_latency;
  };
  Analyzer analyzer(AnalysisOptions{});
  for (const auto& event : trace.events) {
    analyzer.consume(event);
    if (event.head.time.ns != kLastEnd) continue;
    EXPECT_EQ(latency_of(analyzer.look()).count, static_cast<std::uint64_t>(kMessages - 64));
  }
  EXPECT_EQ(latency_of(analyzer.look()).count, static_cast<std::uint64_t>(kMessages));
  const auto at_end = latency_of(analyzer.finish());
  EXPECT_EQ(at_end.count, static_cast<std::uint64_t>(kMessages));
  EXPECT_EQ(at_end.max, kLastEnd - 10);
}

// Up to the start of the next instance nobody else is seen to run.
TEST(LostEnd, AloneLeavesMessagesToTheirInstance) {
  auto trace = trace_of(lost_between(34, ""));
  lose<CallbackEnd>(trace, 34);
  const auto report = analyze(trace).report;
  ASSERT_EQ(report.chains.size(), 1U);
  ASSERT_TRUE(report.chains.front().path_latency);
  EXPECT_EQ(report.chains.front().path_latency->count, 2U);
}

}  // namespace
}  // namespace cie::test
