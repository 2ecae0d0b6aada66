#include <cie/analysis/analyzer.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <trackers/recording_tracker.hpp>
#include <trackers/registry.hpp>

namespace cie::analysis {
namespace {

constexpr CallbackId kCallback{1};

// Two streams of one channel, as one would get from two CPUs. Stream 0 covers [0, 100]; stream 1
// what a test says. Instances are written into stream 0.
class TwoStreams : public testing::Test, private Observer {
 protected:
  explicit TwoStreams(const StreamBegin& second = {}, const StreamBegin& first = {})
      : analyzer_(AnalysisOptions{}, this) {
    push(0, 0, first);
    push(0, 1, second);
  }
  static StreamBegin idle() {
    StreamBegin begin;
    begin.has_events = false;
    return begin;
  }
  void push(std::int64_t time, std::uint32_t stream, const EventBody& body) {
    analyzer_.consume(
        Event{.head = {.time = {time}, .stream = StreamIndex{stream}, .cpu = 0, .pid = 1, .tid = 2},
              .body = body});
  }
  void start(std::int64_t time) {
    CallbackStart event;
    event.callback = kCallback;
    event.seq = seq_;
    push(time, 0, event);
  }
  void end(std::int64_t time) {
    push(time, 0, CallbackEnd{.callback = kCallback, .seq = seq_++, .status = {}});
  }
  CallbackReport finish() { return analyzer_.finish().report.callbacks.at(0); }
  void on_instance(const Instance& instance) override { listed_.push_back(instance); }

  Analyzer analyzer_;
  std::vector<Instance> listed_;
  std::uint64_t seq_ = 0;
};

TEST_F(TwoStreams, CountsWhatBothCoverListsWhatAnEdgeCutsAndForgetsTheRest) {
  push(0, 0, PacketBegin{});
  start(5);  // wholly before stream 1 begins
  end(8);
  start(18);  // cut by the begin at 20
  push(20, 1, PacketBegin{});
  end(22);
  start(30);
  end(40);
  start(55);  // cut by the end at 60
  push(60, 1, PacketEnd{});
  push(60, 1, StreamEnd{});
  end(65);
  start(70);  // wholly after stream 1 ended
  end(80);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  const auto whole = analyzer_.finish().report;
  const auto& report = whole.callbacks.at(0);
  EXPECT_EQ(report.instances, 1U);
  EXPECT_EQ(report.runs_not_seen, 2U);
  EXPECT_EQ(report.outside_window, 2U);
  ASSERT_TRUE(whole.trace.outside);
  EXPECT_EQ(whole.trace.outside->instances, 2U);
  EXPECT_EQ(whole.trace.outside->length, Duration{100 - 40});
  ASSERT_EQ(listed_.size(), 3U);
  EXPECT_EQ(listed_[0].state, InstanceState::cut_by_window);
  EXPECT_EQ(listed_[1].state, InstanceState::complete);
  EXPECT_EQ(listed_[1].start.ns, 30);
  EXPECT_EQ(listed_[2].state, InstanceState::cut_by_window);
}

// As the stream of a CPU on which nothing happened any more, copied while it was recorded.
class OneEndsEarly : public TwoStreams {
 protected:
  OneEndsEarly() : TwoStreams(named("events_1"), named("events_0")) {
    CallbackInit init;
    init.callback = kCallback;
    init.kind = CallbackKind::timer;
    init.logical_id = "n";
    init.deadline_ns = 10;
    push(0, 0, PacketBegin{});
    push(0, 1, PacketBegin{});
    push(1, 0, init);
    start(10);
    end(15);
    push(20, 1, OtherEvent{});
    push(40, 1, PacketEnd{});
    push(40, 1, StreamEnd{});
  }
  AnalysisResult finish_at(std::int64_t time) {
    push(time, 0, PacketEnd{});
    push(time, 0, StreamEnd{});
    return analyzer_.finish();
  }
  static const RuleVerdict& deadline_rule(const AnalysisResult& result) {
    return *std::ranges::find(result.verdicts.rules, "R3", &RuleVerdict::id);
  }

 private:
  static StreamBegin named(std::string_view path) {
    StreamBegin begin;
    begin.path = path;
    return begin;
  }
};

TEST_F(OneEndsEarly, WhatItLeavesOutIsTold) {
  start(50);
  end(55);
  start(70);
  end(75);
  const auto report = finish_at(100).report;
  EXPECT_EQ(report.callbacks.at(0).instances, 1U);
  EXPECT_EQ(report.callbacks.at(0).outside_window, 2U);
  const auto defect =
      std::ranges::find(report.defects, DefectKind::instances_outside_window, &TraceDefect::kind);
  ASSERT_NE(defect, report.defects.end());
  EXPECT_EQ(defect->count, 2U);
  EXPECT_NE(defect->advice.find("; events_1 ends first"), std::string::npos) << defect->advice;
}

TEST_F(OneEndsEarly, AMissedDeadlineBehindItIsNoPass) {
  start(50);
  end(61);
  const auto result = finish_at(100);
  EXPECT_EQ(result.report.callbacks.at(0).late, 0U);
  EXPECT_EQ(deadline_rule(result).verdict, Verdict::fail);
}

TEST_F(OneEndsEarly, SoIsOneThatItsEndCuts) {
  start(35);
  end(46);
  EXPECT_EQ(deadline_rule(finish_at(100)).verdict, Verdict::fail);
}

TEST_F(TwoStreams, AnInstanceOnTheVeryEdgesCounts) {
  push(0, 0, PacketBegin{});
  push(20, 1, PacketBegin{});
  start(20);
  end(60);
  push(60, 1, PacketEnd{});
  push(60, 1, StreamEnd{});
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  EXPECT_EQ(finish().instances, 1U);
}

TEST_F(TwoStreams, AnEmptyStreamDoesNotNarrowTheWindow) {
  push(0, 1, StreamEnd{});
  push(0, 0, PacketBegin{});
  start(10);
  end(20);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  EXPECT_EQ(finish().instances, 1U);
}

class OneIsIdle : public TwoStreams {
 protected:
  OneIsIdle() : TwoStreams(idle()) {}
};

// The only packet of an idle CPU begins with the tracer's last flush.
TEST_F(OneIsIdle, ItCoversEverythingUpToItsEnd) {
  push(0, 0, PacketBegin{});
  start(10);
  end(20);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  push(116, 1, PacketBegin{});
  push(120, 1, PacketEnd{});
  push(120, 1, StreamEnd{});
  const auto report = analyzer_.finish().report;
  EXPECT_EQ(report.callbacks.at(0).instances, 1U);
  EXPECT_EQ(report.trace.begin, Timestamp{0});
  EXPECT_EQ(report.trace.end, Timestamp{100});
}

TEST_F(OneIsIdle, NothingIsKnownOfItsCpuAfterItsEnd) {
  push(0, 0, PacketBegin{});
  start(10);
  end(20);
  push(30, 1, PacketBegin{});
  push(40, 1, PacketEnd{});
  push(40, 1, StreamEnd{});
  start(50);
  end(60);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  const auto report = analyzer_.finish().report;
  EXPECT_EQ(report.callbacks.at(0).instances, 1U);
  EXPECT_EQ(report.trace.end, Timestamp{40});
}

// As in a chunk that begins with the flush of the one before: LTTng flushes no buffer twice that stays empty.
TEST_F(OneIsIdle, AFlushOfAnEmptyBufferEndsNothing) {
  push(0, 0, PacketBegin{});
  push(2, 1, PacketBegin{});
  push(2, 1, PacketEnd{});
  push(2, 1, StreamEnd{});
  start(50);
  end(60);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  const auto report = analyzer_.finish().report;
  EXPECT_EQ(report.callbacks.at(0).instances, 1U);
  EXPECT_EQ(report.trace.end, Timestamp{100});
}

// Taken for idle, as it was silent for so long. A silence is no loss.
TEST_F(OneIsIdle, ThatHasAnEventAfterAllNarrowsTheWindowAndLostNothing) {
  constexpr std::int64_t kLate =
      10'000'000'000;  // when nobody waits for what is announced any more
  push(0, 0, PacketBegin{});
  start(5);
  end(8);
  push(kLate, 0, OtherEvent{});
  push(kLate + 20, 1, PacketBegin{});
  start(kLate + 25);
  push(kLate + 30, 1, OtherEvent{});
  end(kLate + 40);
  push(kLate + 100, 1, PacketEnd{});
  push(kLate + 100, 1, StreamEnd{});
  push(kLate + 300, 0, PacketEnd{});
  push(kLate + 300, 0, StreamEnd{});
  const auto report = analyzer_.finish().report;
  EXPECT_EQ(report.callbacks.at(0).instances, 2U);
  EXPECT_EQ(report.trace.begin, Timestamp{kLate + 20});
  EXPECT_EQ(std::ranges::count(report.defects, DefectKind::discarded_packets, &TraceDefect::kind),
            0);
}

class BothAreIdle : public TwoStreams {
 protected:
  BothAreIdle() : TwoStreams(idle(), idle()) {}
};

// Streams of a process that is started while others run.
TEST_F(BothAreIdle, WhatBeginsBeforeAnythingWasCountedLosesNothing) {
  push(0, 0, PacketBegin{});
  push(1, 1, PacketBegin{});
  start(5);
  end(8);
  push(9, 1, OtherEvent{});
  push(100, 0, PacketEnd{});
  push(100, 1, PacketEnd{});
  const auto report = analyzer_.finish().report;
  EXPECT_EQ(report.callbacks.at(0).instances, 1U);
  EXPECT_EQ(report.trace.begin, Timestamp{1});
  EXPECT_EQ(std::ranges::count(report.defects, DefectKind::discarded_packets, &TraceDefect::kind),
            0);
}

class OneIsLeftOut : public TwoStreams {
 protected:
  OneIsLeftOut() : TwoStreams(left_out()) {}

 private:
  static StreamBegin left_out() {
    StreamBegin begin;
    begin.path = "channel_1";
    begin.is_left_out = true;
    return begin;
  }
};

TEST_F(OneIsLeftOut, TheWindowIsThatOfTheOtherAndItIsNamed) {
  push(0, 0, PacketBegin{});
  start(10);
  end(20);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  push(200, 1, PacketBegin{});
  push(300, 1, PacketEnd{});
  push(300, 1, StreamEnd{});
  const auto report = analyzer_.finish().report;
  EXPECT_EQ(report.callbacks.at(0).instances, 1U);
  EXPECT_EQ(report.trace.end, Timestamp{100});
  const auto defect =
      std::ranges::find(report.defects, DefectKind::streams_left_out, &TraceDefect::kind);
  ASSERT_NE(defect, report.defects.end());
  EXPECT_NE(defect->advice.find("channel_1"), std::string::npos);
}

// Who reads without knowing what comes cannot leave any out: then nothing is counted. Nobody said that anything
// was lost.
TEST_F(TwoStreams, ThatHaveNothingInCommonAreADefect) {
  push(0, 0, PacketBegin{});
  start(10);
  end(20);
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  push(200, 1, PacketBegin{});
  push(210, 1, OtherEvent{});
  push(300, 1, PacketEnd{});
  push(300, 1, StreamEnd{});
  const auto result = analyzer_.finish();
  EXPECT_EQ(result.report.callbacks.at(0).instances, 0U);
  EXPECT_TRUE(std::ranges::count(result.report.defects, DefectKind::streams_apart,
                                 &TraceDefect::kind) == 1);
  EXPECT_FALSE(
      std::ranges::count(result.report.defects, DefectKind::discarded_packets, &TraceDefect::kind));
  EXPECT_EQ(result.verdicts.verdict, Verdict::inconclusive);
}

TEST_F(TwoStreams, AnInstanceThatNeverEndsIsListedNotCounted) {
  push(0, 0, PacketBegin{});
  push(0, 1, PacketBegin{});
  start(10);
  push(100, 0, PacketEnd{});
  push(100, 1, PacketEnd{});
  const auto report = finish();
  EXPECT_EQ(report.instances, 0U);
  EXPECT_EQ(report.incomplete, 1U);
  ASSERT_EQ(listed_.size(), 1U);
  EXPECT_EQ(listed_[0].state, InstanceState::open);
  EXPECT_FALSE(listed_[0].end.has_value());
}

TEST_F(TwoStreams, AnEndWithoutAStartIsNoInstance) {
  push(0, 0, PacketBegin{});
  push(0, 1, PacketBegin{});
  end(10);
  start(20);
  end(30);
  push(100, 0, PacketEnd{});
  push(100, 1, PacketEnd{});
  EXPECT_EQ(finish().instances, 1U);
  EXPECT_EQ(listed_.size(), 1U);
}

// A channel that describes objects is quiet for most of a chunk, and its stream ends with its last packet.
class QuietState : public TwoStreams {
 protected:
  static StreamBegin second(bool is_copy) {
    StreamBegin begin;
    begin.channel = 1;
    begin.is_descriptive = true;
    begin.writer = is_copy ? PacketWriter::copier : PacketWriter::lttng;
    return begin;
  }
  explicit QuietState(bool is_copy = true) : TwoStreams(second(is_copy)) {}
  TimeWindow window() {
    push(0, 0, PacketBegin{});
    push(5, 1, PacketBegin{});
    push(10, 1, PacketEnd{});
    push(10, 1, StreamEnd{});
    start(30);
    end(40);
    push(100, 0, PacketEnd{});
    push(100, 0, StreamEnd{});
    const auto report = analyzer_.finish().report;
    EXPECT_EQ(report.callbacks.at(0).instances, 1U);
    return {.from = *report.trace.begin, .to = *report.trace.end};
  }
};

class QuietStateOfLttng : public QuietState {
 protected:
  QuietStateOfLttng() : QuietState(false) {}
};

TEST_F(QuietStateOfLttng, DoesNotNarrowItWhereInstancesCountBehindItsEnd) {
  const auto whole = window();
  EXPECT_EQ(whole.from, Timestamp{0});
  EXPECT_EQ(whole.to, Timestamp{100}) << "the instance from 30 to 40 counts";
}

TEST_F(QuietStateOfLttng, NarrowsItWhereNoneDoes) {
  push(0, 0, PacketBegin{});
  push(5, 1, PacketBegin{});
  start(6);
  end(9);
  push(10, 1, PacketEnd{});
  push(10, 1, StreamEnd{});
  push(100, 0, PacketEnd{});
  push(100, 0, StreamEnd{});
  const auto trace = analyzer_.finish().report.trace;
  EXPECT_EQ(trace.begin, Timestamp{5});
  EXPECT_EQ(trace.end, Timestamp{10});
}

// Who looks for the window alone has no instances.
TEST_F(QuietStateOfLttng, IsOutlastedByWhatRanAsToldToTheTracker) {
  const auto end_of = [](bool has_run) {
    Model model;
    Registry registry(model);
    RecordingTracker recording(model, registry);
    const auto head = [](std::int64_t time, std::uint32_t stream) {
      return EventHead{
          .time = {time}, .stream = StreamIndex{stream}, .cpu = 0, .pid = {}, .tid = {}};
    };
    recording.apply(head(0, 0), StreamBegin{});
    recording.apply(head(0, 1), second(false));
    recording.apply(head(0, 0), PacketBegin{});
    recording.apply(head(5, 1), PacketBegin{});
    recording.apply(head(10, 1), PacketEnd{});
    recording.apply(head(10, 1), StreamEnd{});
    if (has_run) recording.note_run(StreamIndex{0}, {40});
    recording.apply(head(100, 0), PacketEnd{});
    recording.apply(head(100, 0), StreamEnd{});
    recording.finish();
    return model.end;
  };
  EXPECT_EQ(end_of(true), Timestamp{100});
  EXPECT_EQ(end_of(false), Timestamp{10});
}

TEST_F(QuietState, DoesNotNarrowTheWindowOfTheWhole) {
  const auto whole = window();
  EXPECT_EQ(whole.from, Timestamp{0});
  EXPECT_EQ(whole.to, Timestamp{100});
}

}  // namespace
}  // namespace cie::analysis
