// What the kernel's record adds to verdicts, and what its holes take away (laws L5 and L6).
#include "support/laws.hpp"
#include "support/verdicts.hpp"

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
using testing::HasSubstr;

struct Row : Instance {
  std::string id;
};

struct Rows final : Observer {
  std::vector<Row> all;
  void on_instance(const Instance& instance) override {
    all.push_back({{instance}, std::string(instance.logical_id)});
  }
};

std::vector<Row> rows_of(const TextTrace& trace) {
  Rows rows;
  analyze(trace, {}, &rows);
  return rows.all;
}

const ThreadReport& thread_of(const AnalysisResult& result, std::int64_t tid) {
  return *std::ranges::find(result.report.threads, tid, &ThreadReport::tid);
}

// As if the kernel's tracer had not had this CPU.
TextTrace without_cpu(TextTrace trace, std::int32_t cpu) {
  std::set<StreamIndex> gone;
  for (const auto& event : trace.events) {
    const auto* stream = std::get_if<StreamBegin>(&event.body);
    if (stream != nullptr && stream->domain == Domain::kernel && event.head.cpu == cpu) {
      gone.insert(event.head.stream);
    }
  }
  std::erase_if(trace.events,
                [&gone](const Event& event) { return gone.contains(event.head.stream); });
  return trace;
}

TextTrace with_kernel_clock(TextTrace trace, std::string_view uuid) {
  for (auto& event : trace.events) {
    auto* stream = std::get_if<StreamBegin>(&event.body);
    if (stream != nullptr && stream->domain == Domain::kernel) stream->clock_uuid = uuid;
  }
  return trace;
}

// A thread of priority 80 that the kernel shows at 50, on a CPU that it may not use, for longer
// than it may take: if these were its switches.
constexpr auto kAccused = R"(
  callback fusion
  -100 initial fusion policy=other
  -90 applied fusion policy=fifo priority=80 cpus=0
  10 switch 1 idle fusion next_prio=49
  12 start fusion cpu=0
  18 end fusion cpu=0
  19 switch 1 fusion idle state=1 prio=49
  25 damage kernel
  30 audit fusion policy=fifo priority=80 cpus=0)";
constexpr auto kBudget = "callback_groups:\n  - id: fusion\n    wcet: 6\n";

std::vector<std::string> verdicts_but_t6(const Verified& verified) {
  std::vector<std::string> all;
  for (const auto& rule : verified.result.verdicts.rules) {
    if (rule.id == "T1" || rule.id == "T6" || rule.id == "T2")
      continue;  // of the traces themselves
    all.push_back(rule.id + ' ' + std::string(label(rule.verdict)));
    all.push_back(explain(verified, rule.id));
  }
  return all;
}

TEST(UnrelatedKernelTrace, IsNoEvidenceForOrAgainstAnything) {
  const auto related = trace_of(kAccused);
  const Verified alone(without_kernel(related), kBudget);
  for (const auto* uuid : {"", "another boot"}) {
    const Verified unrelated(with_kernel_clock(related, uuid), kBudget);
    EXPECT_EQ(unrelated["T6"], Verdict::inconclusive) << uuid;
    EXPECT_EQ(unrelated["T2"], Verdict::pass) << uuid;
    EXPECT_EQ(verdicts_but_t6(unrelated), verdicts_but_t6(alone)) << uuid;
    EXPECT_FALSE(thread_of(unrelated.result, 101).busy_ns) << uuid;
  }
  EXPECT_EQ(Verified(related, kBudget)["S3"], Verdict::fail) << "on one time axis it is evidence";
}

TEST(UnrelatedKernelTrace, MeasuresNothing) {
  const auto rows = rows_of(with_kernel_clock(trace_of(kAccused), ""));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_FALSE(rows[0].execution);
  EXPECT_FALSE(rows[0].waking);
}

// FIFO 80 is kernel priority 19.
constexpr auto kSoundRun = R"(
  callback fusion
  -100 initial fusion policy=other
  -90 applied fusion policy=fifo priority=80
  5 waking fusion
  10 switch 0 idle fusion next_prio=19
  12 start fusion
  18 end fusion
  19 switch 0 fusion idle state=1 prio=19
  30 audit fusion policy=fifo priority=80)";

Verified with_hole(const std::string& hole, AnalysisOptions options = {}) {
  return Verified(trace_of(std::string(kSoundRun) + "\n" + hole), kBudget, options);
}

TEST(HolesInTheKernelsRecord, CostNothingThatTheUsersEventsDecide) {
  for (const auto* hole :
       {"20 discard kernel until=28 count=3", "20 damage kernel", "20 switch 0 fusion idle prio=19",
        "13 discard kernel until=14 packets"}) {
    const auto verified = with_hole(hole);
    for (const auto* rule : {"T2", "S3", "S4", "S5", "R4", "M6"})
      EXPECT_EQ(verified[rule], Verdict::pass) << rule << ' ' << hole;
    EXPECT_THAT(verified.evidence("S3", "thread 101"), HasSubstr("by read-back")) << hole;
    EXPECT_THAT(verified.evidence("S4", "thread 101"), HasSubstr("sampled")) << hole;
    EXPECT_THAT(verified.evidence("S5", "thread 101"), HasSubstr("announced only")) << hole;
  }
  EXPECT_EQ(with_hole("")["S3"], Verdict::pass);
  EXPECT_EQ(with_hole("").evidence("S3", "thread 101"), "");
}

TEST(HolesInTheKernelsRecord, AreNamedAndFailOnlyWhereNothingMayBeLost) {
  EXPECT_THAT(with_hole("20 discard kernel until=28 count=3").evidence("T2", "trace"),
              HasSubstr("20 discarded_events 3 lost until 28, kernel"));
  AnalysisOptions lossless;
  lossless.require_lossless = true;
  EXPECT_EQ(with_hole("20 discard kernel until=28 count=3", lossless)["T2"], Verdict::fail);
}

TEST(HolesInTheKernelsRecord, TakeThePartsOfTheInstancesThatTheyTouch) {
  const auto trace = std::string(kSoundRun) +
                     "\n40 switch 0 idle fusion next_prio=19\n42 start fusion\n50 end fusion\n"
                     "51 switch 0 fusion idle state=1 prio=19\n45 discard kernel until=46 count=1";
  const auto rows = rows_of(trace_of(trace));
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].execution, Duration{6});
  EXPECT_FALSE(rows[1].execution);
  const Verified verified(trace_of(trace), kBudget);
  EXPECT_EQ(verified["R4"], Verdict::inconclusive) << "8 ns, of an unknown part on a CPU";
  EXPECT_THAT(verified.evidence("R4", "callback fusion"), HasSubstr("its CPU time is not known"));
  EXPECT_FALSE(thread_of(verified.result, 101).busy_ns);
}

// While a thread does not leave its CPU, what happens on others does not concern it.
TEST(HolesInTheKernelsRecord, OnOtherCpusDoNotTouchAThreadThatStays) {
  const auto rows = rows_of(trace_of(std::string(kSoundRun) + R"(
    thread other worker cpu=1
    2 switch 1 idle other
    13 switch 1 idle other)"));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].execution, Duration{6});
}

TEST(HolesInTheKernelsRecord, LeaveAFailureThatTheUsersEventsShow) {
  const auto trace = trace_of(std::string(kSoundRun) +
                              "\n40 audit fusion policy=fifo priority=79\n"
                              "20 discard kernel until=28 count=3");
  EXPECT_EQ(Verified(trace)["S3"], Verdict::fail);
  EXPECT_EQ(Verified(without_kernel(trace))["S3"], Verdict::fail);
}

// The child was given its priority by somebody, on its first run or before it.
TEST(HolesInTheKernelsRecord, LeaveNoChildAccusedWhoseFirstRunMayBeLost) {
  const auto judged = [](const std::string& hole) {
    return Verified(std::string(kSoundRun) + "\nthread child pool silent cpu=1\n" +
                    "20 fork fusion child\n26 switch 1 idle child next_prio=19\n" + hole)["S5"];
  };
  EXPECT_EQ(judged(""), Verdict::fail);
  EXPECT_EQ(judged("22 discard kernel until=24 count=1"), Verdict::pass);
  EXPECT_EQ(judged("28 discard kernel until=29 count=1"), Verdict::fail);
}

// A wake-up that is lost leaves an earlier one as the last: the user's own sign is what remains.
TEST(HolesInTheKernelsRecord, LeaveNoWakeUpThatMayNotBeTheLast) {
  constexpr auto kWoken = R"(
    callback fusion
    5 waking fusion
    6 switch 0 idle fusion
    7 switch 0 fusion idle state=1
    28 waking fusion
    29 switch 0 idle fusion
    30 wakeup fusion
    32 start fusion release=none
    38 end fusion
    39 switch 0 fusion idle state=1)";
  const auto whole = rows_of(trace_of(kWoken));
  EXPECT_EQ(whole[0].release, Timestamp{28});
  auto trace = trace_of(std::string(kWoken) + "\n27 discard kernel until=29 count=2");
  trace.erase<SchedWaking>(
      [](const SchedWaking&, const EventHead& head) { return head.time.ns == 28; });
  const auto rows = rows_of(trace);
  EXPECT_EQ(rows[0].release, Timestamp{30}) << "not 5";
  EXPECT_FALSE(rows[0].waking);
}

// CPU 0 has a record, CPU 1 may have none: `stays` never leaves CPU 0 while it runs an instance,
// `roams` leaves it and comes back, `far` runs on CPU 1, and `bound` may use CPU 0 alone.
constexpr auto kTwoCpus = R"(
  callback stays
  callback roams
  callback far cpu=1
  callback bound
  -100 initial bound cpus=0
  -90 applied bound cpus=0
  10 switch 0 idle stays
  11 start stays
  17 end stays
  18 switch 0 stays roams state=1
  20 start roams
  24 switch 0 roams idle state=1
  26 waking roams
  30 switch 1 idle roams
  40 switch 1 roams idle state=0
  44 switch 0 idle roams
  50 end roams
  51 switch 0 roams bound state=1
  52 start bound
  54 switch 0 bound stays state=0
  58 switch 0 stays bound state=1
  60 end bound
  61 switch 0 bound idle state=1
  62 switch 1 idle far
  63 start far
  70 switch 1 far idle state=1
  80 waking far
  81 switch 1 idle far
  90 end far
  91 switch 1 far idle state=1)";

Row of(const std::vector<Row>& rows, std::string_view id) {
  return *std::ranges::find(rows, id, &Row::id);
}

TEST(ACpuWithoutARecord, MeasuresNothingThatMayHaveRunThere) {
  const auto trace = trace_of(kTwoCpus);
  const auto whole = rows_of(trace);
  EXPECT_EQ(of(whole, "roams").execution, Duration{20});  // 4 + 10 + 6
  EXPECT_EQ(of(whole, "far").execution, Duration{16});
  const auto half = rows_of(without_cpu(trace, 1));
  EXPECT_EQ(of(half, "stays").execution, Duration{6});
  EXPECT_EQ(of(half, "bound").execution, Duration{4});
  EXPECT_EQ(of(half, "bound").preempted, Duration{4});
  EXPECT_FALSE(of(half, "roams").execution);
  EXPECT_FALSE(of(half, "far").execution);
}

TEST(ACpuWithoutARecord, LeavesTheBudgetToTheDuration) {
  const auto spec = [](const char* id, int wcet) {
    return "callback_groups:\n  - id: " + std::string(id) + "\n    wcet: " + std::to_string(wcet);
  };
  const auto half = without_cpu(trace_of(kTwoCpus), 1);
  // 27 ns from start to end, 16 of them on a CPU.
  EXPECT_EQ(Verified(half, spec("far", 27))["R4"], Verdict::pass);
  EXPECT_EQ(Verified(half, spec("far", 16))["R4"], Verdict::inconclusive);
  EXPECT_EQ(Verified(trace_of(kTwoCpus), spec("far", 16))["R4"], Verdict::pass);
  EXPECT_EQ(Verified(trace_of(kTwoCpus), spec("far", 15))["R4"], Verdict::fail);
}

TEST(ACpuWithoutARecord, IsNamedAndTakesBusyTimes) {
  const Verified half(without_cpu(trace_of(kTwoCpus), 1));
  EXPECT_EQ(half["T2"], Verdict::pass);
  EXPECT_THAT(half.evidence("T2", "trace"), HasSubstr("1 CPU without a kernel stream"));
  EXPECT_TRUE(std::ranges::any_of(half.result.report.defects, [](const TraceDefect& defect) {
    return defect.kind == DefectKind::cpus_not_recorded && defect.count == 1;
  }));
  EXPECT_FALSE(thread_of(half.result, 103).busy_ns) << "far";
  const Verified whole{trace_of(kTwoCpus)};
  EXPECT_TRUE(thread_of(whole.result, 103).busy_ns);
}

// Recordings of ROS 2 do not tell how many CPUs there are: events of their own do.
TEST(ACpuWithoutARecord, IsProvenByAnEventThere) {
  auto trace =
      without_cpu(trace_of(std::string(kTwoCpus) + "\n1 start far cpu=1\n2 end far cpu=1"), 1);
  for (auto& event : trace.events) {
    if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->online_cpus = 0;
  }
  for (const auto& row : rows_of(trace))
    EXPECT_EQ(row.execution.has_value(), row.id == "stays" || row.id == "bound") << row.id;
}

// What lies outside the packets of its CPU is as much without a record.
TEST(ACpuWithoutARecord, IsOneWhoseStreamEndedBefore) {
  auto trace = trace_of(kTwoCpus);
  std::optional<StreamIndex> ended;
  for (const auto& event : trace.events) {
    if (std::holds_alternative<StreamBegin>(event.body) && event.head.cpu == 1)
      ended = event.head.stream;
  }
  for (auto& event : trace.events) {
    const bool is_edge = std::holds_alternative<PacketEnd>(event.body) ||
                         std::holds_alternative<StreamEnd>(event.body);
    if (event.head.stream == *ended && is_edge) event.head.time = Timestamp{61};
  }
  std::erase_if(trace.events, [&ended](const Event& event) {
    return event.head.stream == *ended && !is_structural(event) && event.head.time.ns > 61;
  });
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  EXPECT_EQ(of(rows_of(trace), "roams").execution, Duration{20});
  EXPECT_FALSE(of(rows_of(trace), "far").execution);
  EXPECT_FALSE(thread_of(analyze(trace), 103).busy_ns);
}

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
    const bool is_hot = phase_of(event.body) == EventPhase::system;
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
constexpr auto kForeign = "callback_groups:\n  - id: fusion\n    foreign_work_budget: 100000000\n";

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

// Foreign work counts from the thread's first wait, at 1: 17 ns of 67. What begins with that at 40 has 4 ns
// of 28, which is less than the 20 % allowed.
TEST(KernelRecord, ThatBeginsLaterThanAThreadsFirstWaitKnowsNotAllOfItsWork) {
  constexpr auto kAllowed =
      "callback_groups:\n  - id: fusion\n    foreign_work_budget: 200000000\n";
  const auto whole = trace_of(kWanderer);
  EXPECT_EQ(Verified(whole, kAllowed).of("M6", "thread 101"), Verdict::fail);
  const Verified late(with_record(whole, 25, kAlways), kAllowed);
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

}  // namespace
}  // namespace cie::test
