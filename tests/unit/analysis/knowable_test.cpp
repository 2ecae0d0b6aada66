// What a recording lets know although an event stands at an awkward place in it.
#include <cie/analysis/analyzer.hpp>

#include "support/trace_text.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

struct Instances : Observer {
  void on_instance(const Instance& instance) override {
    all.push_back(instance);
    Duration sum;
    for (const auto& by : instance.preempted_by)
      sum += by.time;
    by_others.push_back(sum.ns);
  }
  std::vector<Instance> all;
  std::vector<std::int64_t> by_others;
};

std::vector<std::int64_t> parts(const Instance& instance) {
  if (!instance.execution || !instance.blocked) return {};
  return {instance.execution->ns, instance.preempted->ns, instance.blocked->ns,
          instance.wake_delay->ns};
}

using Parts = std::vector<std::int64_t>;

// Streams are merged by time: of an event and a switch of the same nanosecond either may be first.
TEST(Knowable, PartsOfAnInstanceThatStartsInTheNanosecondOfItsSwitchIn) {
  const auto trace = test::trace_of(R"(
    callback fusion
    callback lidar
    2  switch 0 idle fusion
    4  preempt fusion by=lidar
    10 start  fusion release=9       # read before the switch
    10 resume fusion
    15 preempt fusion by=lidar
    18 resume fusion
    20 end    fusion
    30 switch 0 fusion idle)");
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(parts(told.all[0]), (Parts{5 + 2, 3, 0, 0}));
}

TEST(Knowable, WhoRanInsteadOfAnInstanceThatEndsInTheNanosecondOfItsSwitchIn) {
  const auto trace = test::trace_of(R"(
    callback fusion
    callback lidar
    8  switch 0 idle fusion
    10 start  fusion release=9
    15 preempt fusion by=lidar
    20 end    fusion                 # read before the switch
    20 resume fusion
    30 switch 0 fusion idle)");
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(parts(told.all[0]), (Parts{5, 5, 0, 0}));
  EXPECT_EQ(told.by_others, Parts{5});
}

// A thread that runs while the kernel's record begins does so until its first switch.
TEST(Knowable, PartsOfAnInstanceBeforeTheFirstSwitch) {
  const auto trace = test::trace_of(R"(
    callback fusion
    kernel
    10 start  fusion release=9
    20 end    fusion
    30 switch 0 fusion idle)");
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(parts(told.all[0]), (Parts{10, 0, 0, 0}));
}

// What woke a thread belongs to the instance that ended since, though its start is not recorded.
TEST(Knowable, AnEndWithoutItsStartUsesUpTheWakeUp) {
  auto trace = test::trace_of(R"(
    callback fusion waitable
    9  waking fusion
    10 wakeup fusion
    11 start  fusion release=none
    20 end    fusion
    21 start  fusion release=none    # was due already: the thread did not wait
    29 end    fusion)");
  trace.erase<CallbackStart>(
      [](const CallbackStart& start, const auto&) { return start.seq == 0; });
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(told.all[0].waking, std::nullopt);
  EXPECT_EQ(told.all[0].wakeup, std::nullopt);
  EXPECT_EQ(told.all[0].release_source, ReleaseSource::start);
}

// An announcement tells of a thread that has long begun.
// Until the first clock_sync run_begin tells what the wall clock showed.
TEST(Knowable, WhenASampleWasWrittenBeforeTheFirstClockSync) {
  auto trace = test::trace_of(R"(
    publisher out
    thread t1 pool
    callback fusion subscription pooled
    10 publish out on=t1
    30 start fusion on=t1 release=none from=out:0
    40 end fusion on=t1)");
  trace.erase<ClockSync>();
  Instances told;
  const auto result = test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(told.all[0].release_source, ReleaseSource::source_timestamp);
  EXPECT_EQ(told.all[0].release, Timestamp{10});
  EXPECT_EQ(result.report.callbacks.at(0).response_time_upper->max, 30);
}

// What a tid runs as after its thread_fini is another thread's, from its last switch-out on.
TEST(Knowable, HowLongAThreadRanThatGoesOnAfterItsEnd) {
  const auto result = test::analyze(test::trace_of(R"(
    callback fusion
    2  switch 0 idle fusion
    10 start  fusion
    12 end    fusion
    14 finish fusion
    16 switch 0 fusion idle state=1
    28 switch 0 idle fusion
    30 start  fusion
    32 end    fusion
    40 switch 0 fusion idle state=1)"));
  std::vector<std::optional<std::int64_t>> busy;
  for (const auto& thread : result.report.threads) {
    if (thread.tid == 101) busy.push_back(thread.busy_ns);
  }
  EXPECT_EQ(busy, (std::vector<std::optional<std::int64_t>>{16 - 2, 40 - 28}));
}

// Where the former thread left the tid was not seen, so what it ran cannot be told from the later
// one's.
TEST(Knowable, NotHowLongAThreadRanWhoseTidAnotherMayHaveHeld) {
  auto trace = test::trace_of(R"(
    callback fusion
    2  switch 0 idle fusion
    3  begin  fusion
    10 start  fusion
    12 end    fusion
    14 finish fusion
    16 switch 0 fusion idle state=1
    28 switch 0 idle fusion
    29 begin  fusion
    30 start  fusion
    32 end    fusion
    40 switch 0 fusion idle state=1)");
  const auto later = [&trace] {
    const auto result = test::analyze(trace);
    return result.report.threads.back().busy_ns;
  };
  EXPECT_EQ(later(), 40 - 28);
  trace.erase<SchedSwitch>(
      [](const SchedSwitch&, const EventHead& head) { return head.time.ns == 16; });
  EXPECT_EQ(later(), std::nullopt);
}

std::optional<std::uint64_t> longest_queue(const test::TextTrace& trace) {
  return test::analyze(trace).report.callbacks.at(0).longest_queue;
}

// Three samples wait while the first instance runs; one is overwritten as the last comes.
constexpr const char* kQueue = R"(
  callback fusion subscription
  8  release fusion
  10 start fusion
  12 release fusion
  14 release fusion
  16 release fusion
  18 release fusion overwritten=1
  20 end fusion
  22 start fusion
  24 end fusion
  26 start fusion
  28 end fusion
  30 release fusion
  32 start fusion
  34 end fusion)";

TEST(Knowable, HowManySamplesWaitedAtMost) {
  EXPECT_EQ(longest_queue(test::trace_of(kQueue)), 3U);
  EXPECT_EQ(longest_queue(test::trace_of("callback fusion subscription")), std::nullopt)
      << "no release was recorded at all";
  EXPECT_EQ(longest_queue(test::trace_of("callback t timer\n5 start t\n6 end t")), std::nullopt);
}

using SampleLosses = std::pair<std::optional<std::uint64_t>, std::optional<std::uint64_t>>;

// Lost before the queue, and overwritten in it.
SampleLosses sample_losses(const test::TextTrace& trace) {
  const auto result = test::analyze(trace);
  const auto& callback = result.report.callbacks.at(0);
  return {callback.lost_samples, callback.overwritten_samples};
}

TEST(Knowable, HowManySamplesWereLostAndOverwritten) {
  const auto text = std::string(kQueue) + "\n19 lost fusion count=3\n29 lost fusion count=2";
  EXPECT_EQ(sample_losses(test::trace_of(text)), (SampleLosses{3 + 2, 1}));
  EXPECT_EQ(sample_losses(test::trace_of("callback fusion subscription\n5 release fusion")),
            (SampleLosses{0, 0}));
  EXPECT_EQ(sample_losses(test::trace_of("callback t timer\n5 start t\n6 end t")), SampleLosses())
      << "a timer has no samples";
}

TEST(Knowable, SampleLossesByTotalsThatWereSeen) {
  const auto text = std::string(kQueue) + "\n29 lost fusion count=2";
  EXPECT_EQ(sample_losses(test::trace_of("process app crash" + text)), SampleLosses())
      << "there may have been more";
  EXPECT_EQ(sample_losses(test::trace_of("process app attached crash" + text)),
            (SampleLosses{2, 1}))
      << "running totals";
  auto announced_later = test::trace_of("process app crash" + text + "\n36 reload");
  announced_later.erase<RunBegin>(
      [](const RunBegin&, const EventHead& head) { return head.time.ns < 36; });
  EXPECT_EQ(sample_losses(announced_later), SampleLosses()) << "recorded from its begin";
  auto after_a_loss = test::trace_of("process app attached crash" + text);
  after_a_loss.erase<CallbackStart>(
      [](const CallbackStart& e, const EventHead&) { return e.seq == 1; });
  EXPECT_EQ(sample_losses(after_a_loss), SampleLosses());
}

// Attached to a process that has handled seven samples and had two overwritten.
TEST(Knowable, HowManySamplesWaitedAtMostSinceTheRecorderAttached) {
  auto trace = test::trace_of(R"(
    process app attached
    callback fusion subscription next=7
    10 release fusion
    12 release fusion
    14 start fusion
    16 end fusion)");
  std::uint64_t released = 9;
  for (auto& event : trace.events) {
    if (auto* release = std::get_if<CallbackRelease>(&event.body)) {
      release->release_seq = released++;
      release->overwritten = 2;
    }
  }
  EXPECT_EQ(longest_queue(trace), 2U);
}

// Readers exist before the executor spins, which registers their callbacks.
TEST(Knowable, HowManySamplesWaitedBeforeTheCallbackWasRegistered) {
  auto trace = test::trace_of(R"(
    callback fusion subscription
    8  release fusion
    9  release fusion
    14 start fusion
    16 end fusion
    18 start fusion
    20 end fusion)");
  for (auto& event : trace.events) {
    if (std::holds_alternative<CallbackInit>(event.body)) event.head.time = Timestamp{12};
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& e) { return e.head.time; });
  EXPECT_EQ(longest_queue(trace), 2U);
}

TEST(Knowable, NotHowManySamplesWaitedAfterALoss) {
  auto without_start = test::trace_of(kQueue);
  without_start.erase<CallbackStart>(
      [](const CallbackStart& e, const EventHead&) { return e.seq == 1; });
  EXPECT_EQ(longest_queue(without_start), std::nullopt);
  auto without_release = test::trace_of(kQueue);
  without_release.erase<CallbackRelease>(
      [](const CallbackRelease& e, const EventHead&) { return e.release_seq == 4; });
  EXPECT_EQ(longest_queue(without_release), std::nullopt);
}

TEST(Knowable, AnAnnouncementLeavesTheWakeUpAlone) {
  auto trace = test::trace_of(R"(
    process app attached
    callback fusion next=7
    9  waking fusion
    10 wakeup fusion
    12 begin  fusion
    13 audit  fusion
    15 start  fusion release=11
    20 end    fusion)");
  for (auto& event : trace.events) {
    if (auto* init = std::get_if<ThreadInit>(&event.body)) init->start_ns = -5'000;
  }
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(told.all[0].waking, Timestamp{9});
  EXPECT_EQ(told.all[0].wakeup, Timestamp{10});
}

// Neighbours are found by number, in whatever order instances end.
TEST(Knowable, InterArrivalTimesOfInstancesThatEndInAnyOrder) {
  std::array<int, 5> order = {0, 1, 2, 3, 4};
  do {
    std::string text = "group g reentrant\ncallback fusion group=g pooled\n";
    for (const int i : order)
      text += "thread t" + std::to_string(i) + " pool\n";
    int place = 0;
    for (const int i : order) {
      const auto seq = std::to_string(i);
      // Released at 0, 10, 30, 60, 100.
      text += std::to_string(101 + i) + " start fusion on=t" + seq + " seq=" + seq +
              " release=" + std::to_string(i * (i + 1) * 5) + '\n';
      text += std::to_string(200 + place++) + " end fusion on=t" + seq + " seq=" + seq + '\n';
    }
    const auto result = test::analyze(test::trace_of(text));
    const auto& gaps = result.report.callbacks.at(0).inter_arrival;
    ASSERT_TRUE(gaps.has_value()) << text;
    EXPECT_EQ(gaps->count, 4U) << text;
    EXPECT_EQ(gaps->min, 10) << text;
    EXPECT_EQ(gaps->max, 40) << text;
    EXPECT_EQ(gaps->sum, 100) << text;
  } while (std::ranges::next_permutation(order).found);
}

// Nobody counted what a damaged packet held.
TEST(Knowable, HowManyEventsWereLostIsNotWhereAPacketIsDamaged) {
  const std::string trace = "callback fusion\n10 start fusion\n12 end fusion";
  const auto lost = [&trace](const char* line) {
    return test::analyze(test::trace_of(trace + line)).report.trace.lost_events;
  };
  EXPECT_EQ(lost(""), 0U);
  EXPECT_EQ(lost("\n13 discard user until=14 count=3"), 3U);
  EXPECT_EQ(lost("\n13 damage user until=14"), std::nullopt);
  EXPECT_EQ(lost("\n13 discard user until=14 count=3\n15 damage kernel until=16"), std::nullopt);
}

}  // namespace
}  // namespace cie::analysis
