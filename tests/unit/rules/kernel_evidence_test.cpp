// What the kernel's record adds to verdicts, and what its holes take away (laws L5 and L6).
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
              HasSubstr("20 discarded_events 3 kernel events lost within 8 ns"));
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

// The switch out, the one back and the last one are missing untold; then the CPU is idle for 4 s, as an
// isolated one may be. By then the instance was measured.
TEST(HolesInTheKernelsRecord, TakeBackWhatWasMeasuredBeforeTheyWereTold) {
  constexpr const char* kIdle = R"(
    callback fusion
    thread other worker
    5 switch 0 idle fusion
    10 start fusion release=9
    50 end fusion
    30 switch 1 idle other
    60 switch 1 other idle state=1
    3500000000 switch 1 idle other
    3500000010 switch 1 other idle state=1
    4000000000 switch 0 idle fusion
    4000000010 start fusion release=4000000009
    4000000015 end fusion
    4000000020 switch 0 fusion idle state=1
    4000000020 switch 1 idle other)";
  constexpr const char* kSpec = "callback_groups:\n  - {id: fusion, wcet: 30}\n";
  const Verified verified(kIdle, kSpec);
  EXPECT_EQ(verified["R4"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("R4", "callback fusion"),
              HasSubstr("took 40 ns, its CPU time is not known"));
  const Verified whole(std::string(kIdle) + "\n51 switch 0 fusion idle state=1", kSpec);
  EXPECT_EQ(whole["R4"], Verdict::fail);
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

// As many streams as run_begin counts CPUs may be those of others: one of an offline CPU, or of before one
// was plugged in. Who may run on one, or is woken there, shows that it is there.
TEST(ACpuWithoutARecord, IsOneThatAThreadMayUseHoweverManyAreRecorded) {
  const auto judged = [](const std::string& lines, bool is_woken_there) {
    auto trace = without_cpu(trace_of("callback roams\n" + lines + R"(
      10 switch 0 idle roams
      20 start roams
      24 switch 0 roams idle state=1
      26 waking roams
      44 switch 0 idle roams
      50 end roams
      51 switch 0 roams idle state=1)"),
                             1);
    std::erase_if(trace.events, [&lines](const Event& event) {
      return lines.empty() && std::holds_alternative<ThreadSched>(event.body);
    });
    for (auto& event : trace.events) {
      if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->online_cpus = 1;
      const auto* waking = std::get_if<SchedWaking>(&event.body);
      if (waking == nullptr || !is_woken_there) continue;
      event.body = SchedWakeup{.tid = waking->tid, .prio = waking->prio, .target_cpu = 1};
    }
    return Verified(trace, "callback_groups:\n  - {id: roams, wcet: 10}\n");
  };
  const auto untold = judged("", false);
  EXPECT_EQ(untold["R4"], Verdict::pass) << untold.evidence("R4", "roams");
  const auto confined = judged("-100 initial roams cpus=0\n-90 applied roams cpus=0\n", false);
  EXPECT_EQ(confined["R4"], Verdict::pass) << confined.evidence("R4", "roams");
  const auto free = judged("-100 initial roams cpus=0,1\n-90 applied roams cpus=0,1\n", false);
  EXPECT_EQ(free["R4"], Verdict::inconclusive);
  EXPECT_EQ(judged("", true)["R4"], Verdict::inconclusive);
}

// A stream that has no time in common with the others of its channel has none of its CPU in theirs.
TEST(ACpuWithoutARecord, IsOneWhoseStreamIsLeftOut) {
  for (const bool is_idle : {false, true}) {
    const std::uint32_t online_cpus = is_idle ? 2 : 0;  // 0: not told, as of ROS 2
    auto trace = trace_of(std::string(kTwoCpus) + "\n-50 switch 1 idle far\n-49 switch 1 far idle");
    std::optional<StreamIndex> ended;
    for (auto& event : trace.events) {
      if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->online_cpus = online_cpus;
      auto* stream = std::get_if<StreamBegin>(&event.body);
      if (stream == nullptr || event.head.cpu != 1) continue;
      ended = event.head.stream;
      stream->is_left_out = true;
      stream->has_events = !is_idle;
    }
    for (auto& event : trace.events) {
      const bool is_edge = std::holds_alternative<PacketEnd>(event.body) ||
                           std::holds_alternative<StreamEnd>(event.body);
      if (event.head.stream == *ended && is_edge) event.head.time = Timestamp{-40};
    }
    std::erase_if(trace.events, [&](const Event& event) {
      return event.head.stream == *ended && !is_structural(event) &&
             (is_idle || event.head.time.ns > -40);
    });
    std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
    for (const auto& row : rows_of(trace))
      EXPECT_EQ(row.execution.has_value(), row.id == "stays" || row.id == "bound") << row.id;
    EXPECT_FALSE(thread_of(analyze(trace), 103).busy_ns) << "far";
    EXPECT_EQ(Verified(trace, "callback_groups:\n  - {id: roams, wcet: 9}\n")["R4"],
              Verdict::inconclusive);
  }
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

// To the kernel the thread of fusion is 4001: it is in a container. On the host another one, `other`,
// has fusion's tid.
constexpr const char* kContained = R"(
  callback fusion
  thread real worker tid=4001 silent
  5 switch 0 idle real
  10 start fusion release=9
  12 switch 0 real idle
  15 switch 0 idle real
  20 end fusion
  21 switch 0 real idle state=1
  30 switch 1 idle fusion next_prio=19
  31 switch 1 fusion idle state=1 prio=19
  40 switch 0 idle real
  42 start fusion release=41
  44 end fusion
  45 switch 0 real idle state=1)";

TextTrace without_run_begin(const char* text) {
  auto trace = trace_of(text);
  trace.erase<RunBegin>();
  return trace;
}

TEST(AThreadOfAContainer, IsNotTheOneThatHasItsTidOnTheHost) {
  const auto trace = without_run_begin(kContained);
  for (const auto& row : rows_of(trace))
    EXPECT_FALSE(row.execution) << row.start.ns;
  const auto result = analyze(trace);
  EXPECT_FALSE(thread_of(result, 101).busy_ns);
  const Verified verified(trace, "callback_groups:\n  - id: fusion\n    wcet: 8");
  EXPECT_EQ(verified["R4"], Verdict::inconclusive) << "10 ns, of which 3 preempted";
  EXPECT_NE(verified["S3"], Verdict::fail) << "the other one's priority is 80";
  EXPECT_NE(verified["S4"], Verdict::fail) << "the other one ran on CPU 1";
}

// One event where the switches have the tid shows that the kernel names the thread so.
TEST(AThreadOfAContainer, IsNoneThatSpokeWhereTheSwitchesHaveItsTid) {
  const auto trace = without_run_begin(R"(
    callback fusion
    5 switch 0 idle fusion
    10 start fusion release=9
    20 end fusion
    21 switch 0 fusion idle state=1)");
  const auto rows = rows_of(trace);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].execution, Duration{10});
}

}  // namespace
}  // namespace cie::test
