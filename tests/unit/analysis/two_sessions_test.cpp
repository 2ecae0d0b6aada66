// Two sessions of one process, of two CPUs each: 0 is recorded until 100 by the first one and from there
// on by the second one, CPU 1 until 60 and from 150 on.
#include <cie/analysis/analyzer.hpp>

#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

// The streams of CPU 0 and CPU 1, in the first and in the second session.
constexpr std::uint32_t kFirst0 = 0;
constexpr std::uint32_t kFirst1 = 1;
constexpr std::uint32_t kSecond0 = 2;
constexpr std::uint32_t kSecond1 = 3;

Event structure(std::int64_t time, std::uint32_t stream, const EventBody& body) {
  return {.head = {.time = {time}, .stream = StreamIndex{stream}, .cpu = {}, .pid = {}, .tid = {}},
          .body = body};
}

std::vector<Event> structure_of_both(std::int64_t begin, std::int64_t end) {
  std::vector<Event> events;
  for (const auto stream : {kFirst0, kFirst1, kSecond0, kSecond1}) {
    const auto session = stream < kSecond0 ? 0U : 1U;
    events.push_back(structure(begin, stream,
                               StreamBegin{.channel = session,
                                           .trace = session,
                                           .host = "robot",
                                           .clock_uuid = "boot",
                                           .clock_offset_ns = 1'000'000'000,
                                           .path = "ust"}));
  }
  const auto packet = [&events](std::uint32_t stream, std::int64_t from, std::int64_t to) {
    events.push_back(structure(from, stream, PacketBegin{}));
    events.push_back(structure(to, stream, PacketEnd{}));
    events.push_back(structure(to, stream, StreamEnd{}));
  };
  packet(kFirst0, begin, 100);
  packet(kFirst1, begin, 60);
  packet(kSecond0, 100, end);
  packet(kSecond1, 150, end);
  return events;
}

void sort(std::vector<Event>& events) {
  std::ranges::stable_sort(events, {}, [](const Event& event) { return event.head.time; });
}

TextTrace in_two_sessions(TextTrace trace) {
  const auto begin = trace.events.front().head.time.ns;
  const auto end = trace.events.back().head.time.ns;
  std::erase_if(trace.events, [](const Event& event) {
    return category_of(event.body) == EventCategory::structure;
  });
  for (auto& event : trace.events)
    event.head.stream = StreamIndex{event.head.time.ns > 100 ? kSecond0 : kFirst0};
  auto events = structure_of_both(begin, end);
  events.insert(events.end(), trace.events.begin(), trace.events.end());
  sort(events);
  trace.events = std::move(events);
  return trace;
}

// What plan publishes track takes 2 ns later. The second run of track begins in the first window, the third
// and fourth one lie in neither, and the fifth one ends in the second window.
constexpr const char* kPlanAndTrack = R"(
  publisher out topic=/t
  callback plan timer period=30
  callback track subscription topic=/t deadline=19
  20 start plan release=20
  21 publish out on=plan
  22 end plan
  24 start track release=22 from=out:0
  26 end track
  50 start plan release=50
  51 publish out on=plan
  52 end plan
  54 start track release=52 from=out:1
  66 end track
  80 start plan release=80
  81 publish out on=plan
  82 end plan
  84 start track release=82 from=out:2
  102 end track
  110 start plan release=110
  111 publish out on=plan
  112 end plan
  114 start track release=112 from=out:3
  116 end track
  140 start plan release=140
  141 publish out on=plan
  142 end plan
  144 start track release=142 from=out:4
  154 end track
  170 start plan release=170
  171 publish out on=plan
  172 end plan
  174 start track release=172 from=out:5
  176 end track)";

TEST(TwoSessions, EveryNumberedRunBetweenTheirWindowsCounts) {
  const Verified judged(in_two_sessions(trace_of(kPlanAndTrack)));
  const auto& report = judged.result.report;
  ASSERT_EQ(report.callbacks.size(), 2U);
  for (const auto& callback : report.callbacks) {
    EXPECT_EQ(callback.instances, 6U) << callback.logical_id;
    EXPECT_EQ(callback.cut, 0U) << callback.logical_id;
  }
  EXPECT_TRUE(report.trace.complete);
}

TEST(TwoSessions, ALateRunBetweenTheirWindowsFails) {
  const Verified judged(in_two_sessions(trace_of(kPlanAndTrack)));
  EXPECT_EQ(judged.of("R3", "callback track"), Verdict::fail);
  EXPECT_NE(judged.evidence("R3", "callback track").find(std::to_string(102 - 82) + " ns"),
            std::string::npos);
}

TEST(TwoSessions, AgesAreThoseOfRunsThatFollowEachOther) {
  const auto report = analyze(in_two_sessions(trace_of(kPlanAndTrack))).report;
  ASSERT_EQ(report.chains.size(), 1U);
  const auto& chain = report.chains[0];
  EXPECT_EQ(chain.instances, 6U);
  ASSERT_TRUE(chain.data_age && chain.reaction_time);
  EXPECT_EQ(chain.data_age->count, 5U);
  EXPECT_EQ(chain.data_age->max, 102 - 50);
  EXPECT_EQ(chain.reaction_time->max, 102 - 50);
}

TEST(TwoSessions, VerdictsAreThoseOfOne) {
  const Verified one(kPlanAndTrack);
  const Verified two(in_two_sessions(trace_of(kPlanAndTrack)));
  for (const auto& rule : one.result.verdicts.rules)
    EXPECT_EQ(two[rule.id], rule.verdict) << rule.id;
}

TEST(TwoSessions, AWindowBetweenTheirsCutsRunsAsItDoesInOne) {
  AnalysisOptions options;
  options.window = TimeWindow{.from = Timestamp{103}, .to = Timestamp{115}};
  const Verified one(trace_of(kPlanAndTrack), {}, options);
  const Verified two(in_two_sessions(trace_of(kPlanAndTrack)), {}, options);
  const auto cut_and_counted = [](const Verified& judged) {
    std::uint64_t cut = 0;
    std::uint64_t counted = 0;
    for (const auto& callback : judged.result.report.callbacks) {
      cut += callback.cut;
      counted += callback.instances;
    }
    return std::pair(cut, counted);
  };
  EXPECT_EQ(cut_and_counted(one), std::pair(std::uint64_t{1}, std::uint64_t{1}))
      << "track's run from 114 to 116, and plan's from 110 to 112";
  EXPECT_EQ(cut_and_counted(two), cut_and_counted(one));
}

// L2: a run between the windows whose events are gone is missing by its number.
TEST(TwoSessions, ALostRunBetweenTheirWindowsIsDoubted) {
  auto trace = in_two_sessions(trace_of(kPlanAndTrack));
  std::erase_if(trace.events, [](const Event& event) {
    const auto* start = std::get_if<CallbackStart>(&event.body);
    const auto* end = std::get_if<CallbackEnd>(&event.body);
    const auto time = event.head.time.ns;
    return (start != nullptr || end != nullptr) && (time == 84 || time == 102);
  });
  const Verified judged(trace);
  EXPECT_EQ(judged.of("R3", "callback track"), Verdict::inconclusive);
  EXPECT_FALSE(judged.result.report.trace.complete);
}

// Callbacks of processes of which numbers are told, or none.
class ByHand : public testing::Test {
 protected:
  void run(std::int64_t pid, std::int64_t from, std::int64_t to, bool has_numbers = false) {
    const std::uint32_t stream = from > 100 ? kSecond0 : kFirst0;
    CallbackStart start;
    start.callback = CallbackId{1};
    start.seq = seqs_++;
    add(pid, stream, from, !has_numbers, start);
    add(pid, stream, to, !has_numbers,
        CallbackEnd{.callback = CallbackId{1}, .seq = start.seq, .status = {}});
  }
  AnalysisResult result() {
    sort(events_);
    Analyzer analyzer(AnalysisOptions{});
    for (const auto& event : events_)
      analyzer.consume(event);
    return analyzer.finish();
  }
  static std::uint64_t instances(const AnalysisResult& result) {
    std::uint64_t all = 0;
    for (const auto& callback : result.report.callbacks)
      all += callback.instances;
    return all;
  }
  static auto gaps(const AnalysisResult& result) {
    return std::ranges::count(result.report.defects, DefectKind::host_gap, &TraceDefect::kind);
  }

 private:
  void add(std::int64_t pid, std::uint32_t stream, std::int64_t time, bool is_derived,
           const EventBody& body) {
    events_.push_back({.head = {.time = {time},
                                .stream = StreamIndex{stream},
                                .cpu = 0,
                                .pid = pid,
                                .tid = pid,
                                .is_derived = is_derived},
                       .body = body});
  }

  std::vector<Event> events_ = structure_of_both(0, 200);
  std::uint64_t seqs_ = 0;
};

TEST_F(ByHand, WithoutNumbersWhatLiesBetweenTheWindowsIsALoss) {
  run(1, 10, 12);
  run(1, 70, 72);
  run(1, 110, 112);
  run(1, 120, 122);
  run(1, 160, 162);
  const auto result = this->result();
  EXPECT_EQ(instances(result), 2U);
  EXPECT_EQ(gaps(result), 2) << "behind the first window, and before the second one";
  const auto has_two_runs = [](const TraceDefect& defect) {
    return defect.advice.starts_with("2 instances on robot");
  };
  EXPECT_EQ(std::ranges::count_if(result.report.defects, has_two_runs), 1);
  EXPECT_FALSE(result.report.trace.complete);
  for (const std::string id : {"T2", "E2"}) {
    const auto rule = std::ranges::find(result.verdicts.rules, id, &RuleVerdict::id);
    EXPECT_EQ(rule->verdict, Verdict::inconclusive) << id;
  }
}

// No session recorded more of either.
TEST_F(ByHand, WhatOneSessionAloneRecordedHasTheEdgesOfThat) {
  run(1, 10, 12);
  run(1, 70, 72);
  run(2, 110, 112);
  run(2, 160, 162);
  const auto result = this->result();
  EXPECT_EQ(instances(result), 2U);
  EXPECT_EQ(gaps(result), 0);
}

TEST_F(ByHand, AProcessThatBeganInTheSecondSessionIsCountedFromItsWindowOn) {
  run(2, 110, 112, true);
  run(2, 160, 162, true);
  EXPECT_EQ(instances(result()), 1U);
}

}  // namespace
}  // namespace cie::test
