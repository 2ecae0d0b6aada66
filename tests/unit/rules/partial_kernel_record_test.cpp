// A record of a part of the run: what it adds to verdicts, and what lies outside it.
#include "kernel_traces.hpp"
#include "support/laws.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// As if the record of that CPU began or ended then.
TextTrace with_record_of(TextTrace trace, std::int32_t cpu, std::int64_t begin, std::int64_t end) {
  std::set<StreamIndex> moved;
  for (const auto& event : trace.events) {
    const auto* stream = std::get_if<StreamBegin>(&event.body);
    if (stream != nullptr && stream->domain == Domain::kernel && event.head.cpu == cpu) {
      moved.insert(event.head.stream);
    }
  }
  std::erase_if(trace.events, [&](const Event& event) {
    const bool is_hot = category_of(event.body) == EventCategory::system;
    return is_hot && moved.contains(event.head.stream) &&
           (event.head.time.ns < begin || event.head.time.ns > end);
  });
  for (auto& event : trace.events) {
    if (!moved.contains(event.head.stream)) continue;
    auto& time = event.head.time.ns;
    if (std::holds_alternative<PacketBegin>(event.body)) time = std::max(time, begin);
    const bool is_end = std::holds_alternative<PacketEnd>(event.body) ||
                        std::holds_alternative<StreamEnd>(event.body);
    if (is_end) time = std::min(time, end);
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  return trace;
}

constexpr std::int64_t kAlways = 1'000'000;

// L6: a CPU outside its packets is a hole. The thread works on CPU 1 from 30 to 40, outside its callback.
constexpr auto kWanderer = R"(
  callback fusion
  thread rcu worker silent tid=7
  0 switch 0 idle fusion
  1 switch 0 fusion idle state=1
  2 switch 1 idle rcu
  3 switch 1 rcu idle
  10 switch 0 idle fusion
  12 start fusion
  18 end fusion
  19 switch 0 fusion idle state=1
  30 switch 1 idle fusion
  40 switch 1 fusion idle state=1
  50 switch 1 idle rcu
  51 switch 1 rcu idle
  60 switch 0 idle fusion
  62 start fusion
  66 end fusion
  68 finish fusion
  69 switch 0 fusion idle state=1
  70 switch 1 idle rcu
  71 switch 1 rcu idle)";
// Foreign work counts from the thread's first wait, at 1: 17 ns of 67, of which CPU 0 shows 8.
constexpr auto kForeign = "callback_groups:\n  - id: fusion\n    foreign_work_budget: 200000000\n";

TEST(KernelRecord, IsAHoleBeforeACpusFirstPacketAndAfterItsLast) {
  const auto whole = trace_of(kWanderer);
  const Verified sound(whole, kForeign);
  EXPECT_EQ(sound.of("M6", "thread 101"), Verdict::fail);
  EXPECT_TRUE(thread_of(sound.result, 101).busy_ns);
  for (const auto& [begin, end] :
       {std::pair<std::int64_t, std::int64_t>{45, kAlways}, {-kAlways, 25}}) {
    const Verified cut(with_record_of(whole, 1, begin, end), kForeign);
    EXPECT_EQ(cut.of("M6", "thread 101"), Verdict::inconclusive) << begin;
    EXPECT_FALSE(thread_of(cut.result, 101).busy_ns) << begin;
  }
}

// Of all CPUs.
TextTrace with_record(TextTrace trace, std::int64_t begin, std::int64_t end) {
  for (const std::int32_t cpu : {0, 1})
    trace = with_record_of(std::move(trace), cpu, begin, end);
  return trace;
}

// What begins with the wait at 40 has 4 ns of 28, which is less than the 20 % allowed.
TEST(KernelRecord, ThatBeginsLaterThanAThreadsFirstWaitKnowsNotAllOfItsWork) {
  const auto whole = trace_of(kWanderer);
  EXPECT_EQ(Verified(whole, kForeign).of("M6", "thread 101"), Verdict::fail);
  const Verified late(with_record(whole, 25, kAlways), kForeign);
  EXPECT_EQ(late.of("M6", "thread 101"), Verdict::inconclusive);
  EXPECT_THAT(late.evidence("M6", "thread 101"), HasSubstr("the kernel's record begins here"));
}

// FIFO 80 is the kernel's priority 19; nice 0, from 30 on, is 120.
TEST(KernelRecord, OfAPartOfTheRunPassesNoUnchangedPriority) {
  constexpr auto kLowered = R"(
  callback fusion
  -100 initial fusion
  -90 applied fusion policy=fifo priority=80
  10 switch 0 idle fusion next_prio=19
  12 start fusion
  18 end fusion
  19 switch 0 fusion idle state=1 prio=19
  30 switch 0 idle fusion next_prio=120
  32 start fusion
  38 end fusion
  39 switch 0 fusion idle state=1 prio=120)";
  const auto whole = trace_of(kLowered);
  EXPECT_EQ(Verified(whole)["S3"], Verdict::fail);
  EXPECT_EQ(Verified(with_record(whole, -kAlways, 25))["S3"], Verdict::inconclusive);
  const auto audited =
      trace_of(std::string(kLowered) + "\n28 audit fusion policy=fifo priority=80");
  const Verified part(with_record(audited, -kAlways, 25));
  EXPECT_EQ(part["S3"], Verdict::pass);
  EXPECT_THAT(part.evidence("S3", "thread 101"), HasSubstr("by read-back"));
}

// Its own end on CPU 2, where it may not run, is lost; the kernel's record ended before.
TEST(KernelRecord, OfAPartOfTheRunShowsNotAllOfAThreadsCpus) {
  const auto whole = trace_of(R"(
    callback fusion
    -90 applied fusion policy=fifo priority=80 cpus=0
    9 switch 0 idle fusion next_prio=19
    10 start fusion
    12 end fusion
    13 switch 0 fusion idle state=1 prio=19
    30 start fusion
    32 end fusion cpu=2)");
  EXPECT_EQ(Verified(whole)["S4"], Verdict::fail);
  auto lossy = with_record(whole, -kAlways, 25);
  lossy.erase<CallbackEnd>([](const CallbackEnd& e, const EventHead&) { return e.seq == 1; });
  EXPECT_EQ(Verified(lossy)["S4"], Verdict::inconclusive);
}

// One CPU's record begins at 5, the other one's at 8: a window that begins later has no hole.
TEST(KernelRecord, IsWholeInAWindowThatBeginsBehindItsEdges) {
  auto trace = trace_of(R"(
    callback fusion
    thread rcu worker silent tid=7
    -90 applied fusion policy=fifo priority=80
    10 switch 0 idle fusion next_prio=19
    12 start fusion
    18 end fusion
    19 switch 0 fusion idle state=1 prio=19
    20 switch 1 idle rcu
    21 switch 1 rcu idle state=1)");
  trace = with_record_of(with_record_of(trace, 0, 5, kAlways), 1, 8, kAlways);
  EXPECT_EQ(Verified(trace)["S3"], Verdict::inconclusive);
  AnalysisOptions options;
  options.window = TimeWindow{.from = {9}, .to = {kAlways}};
  EXPECT_EQ(Verified(trace, {}, options)["S3"], Verdict::pass);
}

// As after `lttng enable-event --kernel sched_switch`: who inherits a priority is not told.
TEST(KernelRecord, WithoutInheritanceShowsNoRaisedPriority) {
  const auto told = [](const std::string& lines, bool has_inheritance) {
    auto trace = trace_of(
        "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=80\n"
        "12 start fusion\n18 end fusion\n" +
        lines);
    for (auto& event : trace.events) {
      auto* stream = std::get_if<StreamBegin>(&event.body);
      if (stream != nullptr && stream->domain == Domain::kernel)
        stream->has_inheritance = has_inheritance;
    }
    return Verified(trace)["S3"];
  };
  const std::string raised = "5 switch 0 idle fusion next_prio=9\n";
  const std::string audit = "25 audit fusion policy=fifo priority=80\n";
  EXPECT_EQ(told(raised, true), Verdict::fail);
  EXPECT_EQ(told(raised, false), Verdict::inconclusive);
  EXPECT_EQ(told(raised + audit, true), Verdict::fail);
  EXPECT_EQ(told(raised + audit, false), Verdict::pass) << "by read-back";
  EXPECT_EQ(told("5 switch 0 idle fusion next_prio=120\n", false), Verdict::fail) << "lowered";
  EXPECT_EQ(told("5 switch 0 idle fusion next_prio=19\n", false), Verdict::pass);
}

// What an event of a thread lets presume before the kernel's record tells of it counts in no window.
TEST(KernelRecord, CountsInAWindowWhatItTellsThereAlone) {
  auto trace = trace_of(R"(
  callback fusion
  10 start fusion
  14 end fusion
  50 switch 0 idle fusion
  51 start fusion
  55 end fusion
  57 switch 0 fusion idle state=1
  80 switch 0 idle fusion
  81 start fusion
  85 end fusion
  88 switch 0 fusion idle state=1)");
  for (const std::int32_t cpu : {0, 1})
    trace = with_record_of(std::move(trace), cpu, 20, kAlways);
  const auto busy_from = [&trace](std::int64_t from) {
    AnalysisOptions options;
    options.window = TimeWindow{.from = {from}, .to = {90}};
    return thread_of(analyze(trace, options), 101).busy_ns;
  };
  EXPECT_EQ(busy_from(30), 7 + 8);
  EXPECT_EQ(busy_from(52), 5 + 8);
  EXPECT_EQ(busy_from(60), 8);
  EXPECT_FALSE(busy_from(15)) << "the record begins later";
  EXPECT_FALSE(thread_of(analyze(trace), 101).busy_ns) << "it ran before";
}

TEST(KernelRecord, OfACpuThatBeginsLateMayLackABoostOrAFirstRun) {
  constexpr auto kBoosted = R"(
  callback fusion
  thread rcu worker silent tid=7
  -100 initial fusion
  -90 applied fusion policy=fifo priority=80
  2 switch 0 idle fusion next_prio=19
  3 switch 0 fusion idle state=1 prio=19
  5 switch 1 idle rcu
  6 switch 1 rcu idle
  10 switch 0 idle fusion next_prio=9
  12 start fusion
  18 end fusion
  50 switch 1 idle rcu
  51 switch 1 rcu idle)";
  const auto whole = trace_of(kBoosted);
  EXPECT_EQ(Verified(whole)["S3"], Verdict::fail) << "no boost";
  EXPECT_EQ(Verified(with_record_of(whole, 1, 45, kAlways))["S3"], Verdict::inconclusive)
      << "who waited for it may have begun to on CPU 1";
  constexpr auto kForked = R"(
  callback fusion
  thread child worker silent tid=150
  -100 initial fusion
  -90 applied fusion policy=fifo priority=80
  2 switch 0 idle fusion next_prio=19
  5 fork fusion child
  8 switch 1 idle child next_prio=120
  9 switch 1 child idle
  12 start fusion
  18 end fusion
  50 switch 1 idle child next_prio=19
  51 switch 1 child idle prio=19)";
  const auto forked = trace_of(kForked);
  EXPECT_EQ(Verified(forked).of("S5", "thread 150"), Verdict::pass);
  EXPECT_NE(Verified(with_record_of(forked, 1, 45, kAlways)).of("S5", "thread 150"), Verdict::fail)
      << "its first run may have been on CPU 1, and it was given the priority since";
}

// Somebody may wait for a thread when the kernel's record begins: it tells of no waiter.
// Who waits for it from 9 on may have begun to on CPU 1, where nothing else happened.
TEST(KernelRecord, OfAnIdleCpuThatEndsEarlyMayLackABoost) {
  const std::string run = R"(
  callback fusion
  thread rcu worker silent tid=7
  -100 initial fusion
  -90 applied fusion policy=fifo priority=80
  2 switch 0 idle fusion next_prio=19
  3 switch 0 fusion idle state=1 prio=19
  10 switch 0 idle fusion next_prio=9
  12 start fusion
  18 end fusion
  19 switch 0 fusion idle state=1 prio=9
  50 switch 1 idle rcu
  51 switch 1 rcu idle)";
  EXPECT_EQ(Verified(run)["S3"], Verdict::fail);
  for (const std::string busy : {"", "\n5 switch 1 idle rcu\n6 switch 1 rcu idle"}) {
    const Verified cut(with_record_of(trace_of(run + busy), 1, -kAlways, 8));
    EXPECT_EQ(cut["S3"], Verdict::inconclusive) << busy;
    EXPECT_EQ(cut["S4"], Verdict::pass) << busy;
    EXPECT_THAT(cut.evidence("S4", "thread 101"), HasSubstr("sampled")) << busy;
    EXPECT_THAT(cut.evidence("S5", "thread 101"), HasSubstr("announced only")) << busy;
  }
}

TEST(KernelRecord, TellsNotWhoWaitedBeforeIt) {
  const auto judged = [](const std::string& lines) {
    auto trace = trace_of(
        "callback fusion\n-100 initial fusion\n"
        "2 applied fusion policy=fifo priority=80\n" +
        lines + "\n10 start fusion\n12 end fusion");
    for (const std::int32_t cpu : {0, 1})
      trace = with_record_of(std::move(trace), cpu, 1, kAlways);
    return Verified(trace)["S3"];
  };
  const std::string raised = "5 switch 0 idle fusion next_prio=9\n";
  const std::string audit = "15 audit fusion policy=fifo priority=80\n";
  EXPECT_EQ(judged(raised), Verdict::inconclusive);
  EXPECT_EQ(judged(raised + audit), Verdict::pass);
  EXPECT_EQ(
      judged("3 switch 0 idle fusion next_prio=19\n4 switch 0 fusion idle prio=19\n" + raised),
      Verdict::fail)
      << "it ran at its own before";
  EXPECT_EQ(judged("5 switch 0 idle fusion next_prio=30\n"), Verdict::fail) << "a lower one";
}

// The kernel counts tids in its first pid namespace: a container's are others, of which its events tell nothing.
TEST(KernelRecord, TellsNothingOfThreadsOfAnotherPidNamespace) {
  const auto contained = [](TextTrace trace) {
    for (auto& event : trace.events) {
      if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->pid_ns = 4'026'532'000;
    }
    return trace;
  };
  const auto accused = trace_of(kAccused);
  ASSERT_EQ(Verified(accused, kBudget)["S3"], Verdict::fail);
  const Verified alone(contained(without_kernel(accused)), kBudget);
  const Verified verified(contained(accused), kBudget);
  for (const auto* rule : {"M4", "M6", "M9", "S3", "S4", "S5", "R4"})
    EXPECT_EQ(verified[rule], alone[rule]) << rule;
  EXPECT_FALSE(thread_of(verified.result, 101).busy_ns);
}

// A tid is a thread's until that leaves its CPU dead, or the kernel creates another one with it.
TEST(KernelRecord, TellsWhoHasATidNow) {
  const auto judged = [](const char* between) {
    return Verified(std::string(R"(
    callback one id=/a
    callback two id=/b pooled
    thread next worker silent tid=101
    thread shell worker silent tid=9
    8 switch 0 idle one
    10 start one
    12 end one
    )") + between + R"(
    30 switch 0 idle next
    32 start two on=next
    34 end two on=next)")["M2"];
  };
  EXPECT_EQ(judged("14 switch 0 one idle state=1"), Verdict::fail);
  EXPECT_NE(judged("14 exit one\n15 switch 0 one idle state=16"), Verdict::fail);
  EXPECT_NE(judged("15 switch 0 one idle state=16"), Verdict::fail);
  EXPECT_NE(judged("14 switch 0 one idle state=1\n20 fork shell next"), Verdict::fail);
}

// FIFO 80 on CPU 0; what has its tid later runs with nice 0 on CPU 1.
TEST(KernelRecord, ThatMayLackAnExitTellsNotWhoHasATidNow) {
  const std::string run = R"(
    process p crash
    callback fusion
    thread stranger worker silent tid=101
    thread other worker silent tid=9
    -100 initial fusion policy=other
    -90 applied fusion policy=fifo priority=80 cpus=0
    7 switch 1 idle other
    8 switch 0 idle fusion next_prio=19
    10 start fusion cpu=0
    12 end fusion cpu=0
    13 switch 0 fusion idle state=1 prio=19
    14 switch 1 other idle
    40 switch 1 idle stranger next_prio=120
    42 switch 1 stranger idle state=1 prio=120
    44 switch 1 idle other)";
  const std::string exit =
      "\n20 switch 0 idle fusion next_prio=19\n21 exit fusion\n22 switch 0 fusion idle state=16 prio=19";
  const std::string hole = "\n19 discard kernel until=30 count=9";
  const std::string alive = "\n41 wakeup fusion cpu=0";
  const auto expect = [](const TextTrace& trace, Verdict s3, Verdict s4, const char* what) {
    const Verified verified(trace);
    EXPECT_EQ(verified["S3"], s3) << what;
    EXPECT_EQ(verified["S4"], s4) << what;
    return verified.evidence("S3", "thread 101") + verified.evidence("S4", "thread 101");
  };
  constexpr auto kMayBeAnother = "it may be another one";
  const auto sampled = HasSubstr("sampled");
  const auto whole = trace_of(run);
  expect(whole, Verdict::fail, Verdict::fail, "it is the same, since it did not exit");
  EXPECT_THAT(expect(trace_of(run + exit), Verdict::pass, Verdict::pass, "it is another one"),
              Not(sampled));
  EXPECT_THAT(expect(trace_of(run + hole), Verdict::inconclusive, Verdict::pass, kMayBeAnother),
              sampled);
  EXPECT_THAT(
      expect(with_record(whole, 35, kAlways), Verdict::inconclusive, Verdict::pass, kMayBeAnother),
      sampled);
  expect(trace_of(run + hole + alive), Verdict::fail, Verdict::fail, "it speaks later");
  const auto audited = "\n15 audit fusion policy=fifo priority=80 cpus=0";
  EXPECT_THAT(expect(trace_of(run + hole + audited), Verdict::pass, Verdict::pass, kMayBeAnother),
              AllOf(sampled, HasSubstr("by read-back")));
}

}  // namespace
}  // namespace cie::test
