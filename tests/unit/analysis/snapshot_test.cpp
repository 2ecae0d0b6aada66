// Snapshots of a flight recorder: what its buffers had overwritten is the past, and neither lost
// nor violated. They are read as the whole recording is with --window.
#include "support/trace_text.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace cie::analysis;

constexpr StreamIndex kState{7};

// A run with something to miss in each part of it: the 40 before the snapshot, and after.
constexpr const char* kRun = R"(
  callback tick timer period=10
  callback take subscription topic=/t
  callback rare timer period=50 id=/n@Timer(50)
  publisher p topic=/t
  0 start tick release=0
  1 publish p on=tick
  2 end tick
  2 start rare release=0
  3 end rare
  4 release take
  5 start take
  6 end take
  10 start tick release=10
  11 publish p on=tick
  12 end tick
  14 release take overwritten=3
  15 start take
  16 lost take count=2
  17 end take
  38 start tick release=30
  44 end tick
  50 start tick release=50
  51 publish p on=tick
  52 end tick
  53 release take overwritten=3
  55 start take
  57 end take
  60 start tick release=60
  61 publish p on=tick
  62 end tick
  63 release take overwritten=3
  65 start take
  68 end take)";

bool is_state(const Event& event) {
  return event.body.index() >= EventBody(RunBegin{}).index() &&
         event.body.index() <= EventBody(ThreadSched{}).index();
}

// What a flight recorder keeps of it: descriptions in a channel of their own, and of the hot events
// those from `begin` on.
TextTrace snapshot_of(TextTrace trace, std::int64_t begin, bool says_so) {
  std::vector<Event> kept;
  for (auto event : trace.events) {
    if (auto* stream = std::get_if<StreamBegin>(&event.body)) {
      stream->is_snapshot = says_so;
      kept.push_back(event);
      stream->channel = static_cast<std::uint32_t>(kState);
      event.head.stream = kState;
      kept.push_back(event);
      continue;
    }
    if (std::holds_alternative<PacketBegin>(event.body)) {
      auto of_state = event;
      of_state.head.stream = kState;
      kept.push_back(of_state);
      event.head.time = Timestamp{begin};
    } else if (std::holds_alternative<PacketEnd>(event.body) ||
               std::holds_alternative<StreamEnd>(event.body)) {
      auto of_state = event;
      of_state.head.stream = kState;
      kept.push_back(of_state);
    } else if (is_state(event)) {
      event.head.stream = kState;
    } else if (event.head.time.ns < begin) {
      continue;
    }
    kept.push_back(event);
  }
  std::ranges::stable_sort(kept, {}, [](const Event& event) { return event.head.time; });
  trace.events = std::move(kept);
  return trace;
}

// "ID: instances, longest duration" of each callback.
std::string numbers_of(const AnalysisResult& result) {
  std::string text;
  for (const auto& callback : result.report.callbacks) {
    text += callback.logical_id + ": " + std::to_string(callback.instances) + ", " +
            (callback.duration ? std::to_string(callback.duration->max) : "-") + "\n";
  }
  return text;
}

std::string verdicts_of(const AnalysisResult& result) {
  std::string text;
  for (const auto& rule : result.verdicts.rules)
    text += std::string(rule.id) + " " + std::string(label(rule.verdict)) + "\n";
  return text;
}

Verdict verdict_of(const AnalysisResult& result, std::string_view id) {
  const auto& rules = result.verdicts.rules;
  return std::ranges::find(rules, id, &RuleVerdict::id)->verdict;
}

TEST(Snapshot, IsJudgedAsThatPartOfTheWholeRecordingIs) {
  const auto whole = trace_of(kRun);
  AnalysisOptions options;
  options.window = TimeWindow{.from = Timestamp{40}};
  const auto part = analyze(whole, options);
  const auto snapshot = analyze(snapshot_of(whole, 40, true));
  EXPECT_EQ(verdicts_of(snapshot), verdicts_of(part));
  EXPECT_EQ(numbers_of(snapshot), numbers_of(part));
}

TEST(Snapshot, WhatWasOverwrittenIsNotMissing) {
  const auto result = analyze(snapshot_of(trace_of(kRun), 40, true));
  EXPECT_EQ(verdict_of(result, "T3"), Verdict::pass);
  EXPECT_EQ(verdict_of(result, "T4"), Verdict::pass)
      << "totals are those of the process's lifetime";
  EXPECT_EQ(verdict_of(result, "M2"), Verdict::pass);
  EXPECT_EQ(verdict_of(result, "Q1"), Verdict::pass)
      << "the lost sample and the overwritten ones are the past's";
}

TEST(Snapshot, WhatIsMissingWithinItIsLost) {
  auto trace = snapshot_of(trace_of(kRun), 40, true);
  const auto erased = trace.erase<CallbackStart>(
      [](const CallbackStart&, const EventHead& head) { return head.time == Timestamp{60}; });
  ASSERT_EQ(erased, 1U);
  EXPECT_EQ(verdict_of(analyze(trace), "T4"), Verdict::inconclusive) << "the totals tell";
}

TEST(Snapshot, ARecordingThatIsNoneHasLostItsBegin) {
  const auto result = analyze(snapshot_of(trace_of(kRun), 40, false));
  EXPECT_EQ(verdict_of(result, "T3"), Verdict::inconclusive);
  for (const auto& rule : result.verdicts.rules) {
    if (rule.id == "Q1") continue;  // counters tell what was overwritten before, too
    EXPECT_NE(rule.verdict, Verdict::fail) << rule.id << ": lost events prove nothing";
  }
}

// Nothing lost within a snapshot is what tells numbers of before from those that are missing.
TEST(Snapshot, WhatItLacksWithinIsNotThePast) {
  constexpr auto kShared = R"(
  thread t pool
  callback one id=/a pooled
  callback two id=/b pooled
  10 start one on=t
  12 end one on=t
  30 start one on=t
  32 end one on=t
  50 start two on=t
  52 end two on=t
  60 start one on=t
  62 end one on=t)";
  const auto whole = snapshot_of(trace_of(kShared), 20, true);
  EXPECT_EQ(verdict_of(analyze(whole), "M2"), Verdict::fail);
  auto lacking =
      snapshot_of(trace_of(std::string(kShared) + "\n45 discard user until=55 count=2"), 20, true);
  std::erase_if(lacking.events, [](const Event& event) {
    return (std::holds_alternative<CallbackStart>(event.body) ||
            std::holds_alternative<CallbackEnd>(event.body)) &&
           event.head.time.ns >= 50 && event.head.time.ns <= 52;
  });
  const auto result = analyze(lacking);
  EXPECT_EQ(verdict_of(result, "M2"), Verdict::inconclusive);
  EXPECT_EQ(verdict_of(result, "T4"), Verdict::inconclusive);
}

// Its window begins with the channel of its callbacks, whose first event may come much later.
TEST(Snapshot, CountsWhatRanFromItsBeginOn) {
  auto trace = trace_of(R"(
  kernel
  callback tick timer period=100
  0 switch 0 idle tick
  5 switch 0 tick idle state=1
  90 switch 0 idle tick
  100 start tick release=100
  110 end tick
  111 finish tick
  112 switch 0 tick idle state=1)");
  constexpr const char* kBudget =
      "callback_groups:\n  - id: tick\n    foreign_work_budget: 150000000\n";
  for (auto& event : trace.events) {
    if (auto* stream = std::get_if<StreamBegin>(&event.body)) stream->is_snapshot = true;
  }
  const Verified verified(trace, kBudget);
  EXPECT_EQ(verified.result.report.threads.at(0).busy_ns, 5 + 22);
  EXPECT_EQ(verified["M6"], Verdict::pass) << "11 ns of 106";
}

// `late` is announced within the window, and ran from 10 on.
TEST(Window, CountsWhatAThreadRanWithinBeforeItWasKnown) {
  const auto trace = trace_of(R"(
  kernel
  callback tick timer period=100
  callback late timer period=100
  0 switch 0 idle tick
  9 switch 0 tick idle state=1
  10 switch 0 idle late
  40 switch 0 late idle state=1
  50 switch 0 idle late
  52 begin late
  53 start late release=50
  57 end late
  60 switch 0 late idle state=1
  80 start tick release=80
  82 end tick)");
  const auto busy_from = [&trace](std::int64_t from) {
    AnalysisOptions options;
    options.window = TimeWindow{.from = Timestamp{from}, .to = Timestamp{70}};
    for (const auto& thread : analyze(trace, options).report.threads) {
      if (thread.name == "late") return thread.busy_ns;
    }
    return std::optional<std::int64_t>();
  };
  EXPECT_EQ(busy_from(5), 30 + 10);
  EXPECT_EQ(busy_from(30), 10 + 10);
  EXPECT_EQ(busy_from(45), 10);
  EXPECT_EQ(busy_from(55), 5);
}

}  // namespace
}  // namespace cie::test
