// Looking at an analysis that goes on, and what is_live changes.
#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "support/trace_text.hpp"

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <vocabulary/event_batch.hpp>

namespace cie::analysis {
namespace {

constexpr const char* kBusy = R"(
  callback plan timer period=10 deadline=4
  callback drive subscription topic=/t
  publisher path topic=/t
  10 start plan release=10
  11 publish path on=plan
  12 preempt plan by=drive
  13 resume plan
  15 end plan
  15 release drive
  16 start drive from=path:0
  18 end drive
  20 start plan release=20 missed=2
  22 end plan
  30 start plan release=30 seq=3
  32 end plan
  33 discard user until=34 count=5
  40 start plan release=40
  41 end plan)";

std::string text_of(const AnalysisResult& result) {
  std::ostringstream out;
  viewer_export::write_report_json(out, result.report);
  viewer_export::write_verify_json(out, result.verdicts);
  return out.str();
}

TEST(Look, ChangesNothingOfWhatIsSaidAtTheEnd) {
  const auto trace = test::trace_of(kBusy);
  const auto expected = text_of(test::analyze(trace));
  Analyzer analyzer(AnalysisOptions{});
  for (const auto& event : trace.events) {
    analyzer.consume(event);
    const auto once = text_of(analyzer.look());
    EXPECT_EQ(once, text_of(analyzer.look()));
  }
  EXPECT_EQ(text_of(analyzer.finish()), expected);
}

// So many callbacks that the analyzer is told of events before their turn.
TEST(Analyzer, TakesBatchesAsItTakesEvents) {
  constexpr int kCallbacks = 600;
  std::string text = "publisher path topic=/t\n callback drive subscription topic=/t\n";
  for (int i = 0; i < kCallbacks; ++i)
    text += " callback c" + std::to_string(i) + " timer period=100000\n";
  std::int64_t now = 10;
  const auto add = [&](const std::string& event) {
    text += std::to_string(now++) + " " + event + "\n";
  };
  for (int i = 0; i < 2 * kCallbacks; ++i) {
    const auto name = "c" + std::to_string(i % kCallbacks);
    add("wakeup " + name);
    add("start " + name + " release=" + std::to_string(now - 1));
    add("publish path on=" + name);
    add("end " + name);
    add("wakeup drive");
    add("start drive from=path:" + std::to_string(i));
    add("end drive");
  }
  const auto trace = test::trace_of(text);
  Analyzer analyzer(AnalysisOptions{});
  EventBatch batch(256);
  for (const auto& event : trace.events) {
    batch.keep(batch.add() = event);
    if (!batch.is_full() && &event != &trace.events.back()) continue;
    analyzer.consume(batch);
    batch.clear();
  }
  const auto result = analyzer.finish();
  EXPECT_EQ(result.report.callbacks.size(), kCallbacks + 1U);
  EXPECT_EQ(text_of(result), text_of(test::analyze(trace)));
}

TEST(Look, TellsAGapAndForgetsOneThatWasFilled) {
  auto trace = test::trace_of(R"(
    callback plan timer
    10 start plan seq=0
    11 end plan seq=0
    20 start plan seq=2
    21 end plan seq=2
    30 start plan seq=1
    31 end plan seq=1)");
  Analyzer analyzer(AnalysisOptions{.is_live = true});
  const auto gaps = [&analyzer] {
    const auto result = analyzer.look();
    for (const auto& defect : result.report.defects) {
      if (defect.kind == analysis::DefectKind::seq_gaps) return defect.count;
    }
    return std::uint64_t{0};
  };
  for (const auto& event : trace.events) {
    analyzer.consume(event);
    const auto time = event.head.time.ns;
    if (time == 11 || time == 31) {
      EXPECT_EQ(gaps(), 0U) << time;
    }
    if (time == 21) {
      EXPECT_EQ(gaps(), 1U);
    }
  }
}

class Live : public testing::Test {
 protected:
  void push(std::int64_t time, std::uint32_t stream, const EventBody& body) {
    analyzer_.consume(
        Event{.head = {.time = {time}, .stream = StreamIndex{stream}, .cpu = 0, .pid = 1, .tid = 2},
              .body = body});
  }
  void instance(std::int64_t time) {
    CallbackStart start;
    start.callback = CallbackId{1};
    start.seq = seq_;
    push(time, 0, start);
    push(time + 1, 0, CallbackEnd{.callback = CallbackId{1}, .seq = seq_++, .status = {}});
    push(time + 5'000'000'000, 0, ClockSync{});  // long enough to settle what is not announced
  }
  Analyzer analyzer_{AnalysisOptions{.is_live = true}};
  std::uint64_t seq_ = 0;
};

TEST_F(Live, AStreamThatIsSilentHoldsNothingUp) {
  push(0, 0, StreamBegin{});
  push(0, 1, StreamBegin{});
  push(0, 0, PacketBegin{});
  instance(10);
  EXPECT_EQ(analyzer_.look().report.callbacks.at(0).instances, 1U);
}

TEST_F(Live, AStreamThatEndedCutsNothingOff) {
  push(0, 0, StreamBegin{});
  push(0, 1, StreamBegin{});
  push(0, 0, PacketBegin{});
  push(0, 1, PacketBegin{});
  push(5, 1, PacketEnd{});
  push(5, 1, StreamEnd{});
  instance(10);
  EXPECT_EQ(analyzer_.look().report.callbacks.at(0).instances, 1U);
}

TEST_F(Live, AProcessIsOfTheTraceThatShowsItAndOfThoseThatItAnnouncesItselfIn) {
  for (std::uint32_t i = 0; i < 3; ++i) {
    StreamBegin begin;
    begin.trace = 7 + i;
    push(0, i, begin);
  }
  push(10, 0, CallbackStart{});
  RunBegin announcement;
  announcement.moment = RunMoment::announce;
  announcement.pid = 1;
  push(11, 1, announcement);
  push(12, 1, announcement);
  push(13, 2, CallbackStart{});
  EXPECT_EQ(analyzer_.look().report.processes.at(0).traces, (std::vector<std::uint32_t>{7, 8}));
}

TEST_F(Live, LossesAreCountedInBoundedMemory) {
  push(0, 0, StreamBegin{});
  push(0, 0, PacketBegin{});
  constexpr std::int64_t kLosses = 100'000;
  for (std::int64_t i = 0; i < kLosses; ++i) {
    push(i, 0,
         Discarded{.begin = {i}, .end = {i + 1}, .count = std::uint64_t{2}, .packets = false});
  }
  const auto result = analyzer_.look();
  EXPECT_EQ(result.report.trace.lost_events, std::uint64_t{2 * kLosses});
  for (const auto& rule : result.verdicts.rules) {
    for (const auto& subject : rule.subjects)
      EXPECT_LE(subject.evidence.size(), 1000U) << rule.id;
  }
}

}  // namespace
}  // namespace cie::analysis
