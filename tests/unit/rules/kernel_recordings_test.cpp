// Several recordings of one boot's kernel, read together: what each shows stays (laws L2 and L6).
#include "support/laws.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test::kernel_recordings {
namespace {

using namespace analysis;
using testing::HasSubstr;

constexpr std::int64_t kEver = 1'000'000;  // before and after all that the traces below have

// Of the kernel, from one time to another; of these CPUs alone, if it says so.
struct Recorded {
  std::int64_t begin = -kEver;
  std::int64_t end = kEver;
  std::optional<std::int32_t> cpu{};
  bool has_inheritance = true;
};

std::set<StreamIndex> kernel_streams(const TextTrace& trace) {
  std::set<StreamIndex> streams;
  for (const auto& event : trace.events) {
    const auto* begin = std::get_if<StreamBegin>(&event.body);
    if (begin != nullptr && begin->domain == Domain::kernel) streams.insert(event.head.stream);
  }
  return streams;
}

// Adds what one recording has of the trace's kernel events.
void record(std::vector<Event>& events, const TextTrace& trace, const Recorded& recording,
            std::uint32_t number) {
  const auto streams = kernel_streams(trace);
  for (auto event : trace.events) {
    if (!streams.contains(event.head.stream)) continue;
    if (recording.cpu && event.head.cpu != recording.cpu) continue;
    auto& time = event.head.time.ns;
    const bool is_outside = time < recording.begin || time > recording.end;
    if (is_outside && !is_structural(event)) continue;
    time = std::clamp(time, recording.begin, recording.end);
    constexpr std::uint32_t kStreamsEach = 100;
    event.head.stream =
        StreamIndex{static_cast<std::uint32_t>(event.head.stream) + kStreamsEach * (number + 1)};
    if (auto* begin = std::get_if<StreamBegin>(&event.body)) {
      begin->channel += number + 1;
      begin->trace = number + 1;
      begin->has_inheritance = recording.has_inheritance;
    }
    events.push_back(event);
  }
}

// As if these recordings had been made of the kernel, instead of one.
TextTrace recorded_as(const TextTrace& trace, const std::vector<Recorded>& recordings) {
  auto made = without_kernel(trace);
  std::vector<Event> kernel;
  for (std::size_t i = 0; i < recordings.size(); ++i)
    record(kernel, trace, recordings[i], static_cast<std::uint32_t>(i));
  // Kernel events first where times are equal, as the reader has it for streams that begin or end.
  kernel.insert(kernel.end(), made.events.begin(), made.events.end());
  made.events = std::move(kernel);
  std::ranges::stable_sort(made.events, {}, [](const Event& event) { return event.head.time; });
  return made;
}

// FIFO 80 is kernel priority 19. Two instances of 6 and 8 ns, work outside callbacks between them, and a
// child that inherits the priority.
constexpr auto kRun = R"(
  callback fusion
  thread child pool silent cpu=1
  -100 initial fusion policy=other
  -90 switch 0 idle fusion next_prio=120
  -80 applied fusion policy=fifo priority=80
  -70 switch 0 fusion idle state=1 prio=19
  5 waking fusion
  10 switch 0 idle fusion next_prio=19
  12 start fusion
  18 end fusion
  19 audit fusion policy=fifo priority=80
  20 switch 0 fusion idle state=1 prio=19
  40 waking fusion
  41 switch 0 idle fusion next_prio=19
  42 start fusion
  50 end fusion
  52 fork fusion child
  54 switch 1 idle child next_prio=19
  56 switch 1 child idle state=1 prio=19
  59 audit fusion policy=fifo priority=80
  60 switch 0 fusion idle state=1 prio=19)";
// Its first switch and its last one: each recording has some event.
constexpr std::int64_t kFirst = -90;
constexpr std::int64_t kLast = 60;
constexpr auto kSpec =
    "callback_groups:\n  - id: fusion\n    wcet: 7\n    foreign_work_budget: 1\n";

struct Rows final : Observer {
  std::vector<Instance> all;
  void on_instance(const Instance& instance) override { all.push_back(instance); }
};

std::vector<Instance> rows_of(const TextTrace& trace) {
  Rows rows;
  analyze(trace, {}, &rows);
  return rows.all;
}

std::optional<Duration> busy_of(const AnalysisResult& result, std::int64_t tid) {
  const auto ns = std::ranges::find(result.report.threads, tid, &ThreadReport::tid)->busy_ns;
  return ns ? std::optional(Duration{*ns}) : std::nullopt;
}

bool has_switch_mismatch(const Verified& verified) {
  return verified.evidence("T2", "trace").find("switch_mismatch") != std::string::npos;
}

void expect_same(const TextTrace& made, const TextTrace& whole, std::int64_t cut) {
  const Verified one(whole, kSpec);
  const Verified many(made, kSpec);
  for (const auto* rule : {"T2", "M6", "S3", "S4", "S5", "R4"})
    EXPECT_EQ(explain(many, rule), explain(one, rule)) << rule << " at " << cut;
  EXPECT_EQ(busy_of(many.result, 101), busy_of(one.result, 101)) << cut;
  const auto rows = rows_of(made);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].execution, Duration{6}) << cut;
  EXPECT_EQ(rows[1].execution, Duration{8}) << cut;
  EXPECT_EQ(rows[1].waking, Timestamp{40}) << cut;
}

TEST(KernelRecordings, OfOneRunFailWhatItBreaks) {
  const Verified whole(trace_of(kRun), kSpec);
  EXPECT_EQ(whole["R4"], Verdict::fail) << "8 ns of 7";
  EXPECT_EQ(whole["S5"], Verdict::fail);
  EXPECT_EQ(whole["M6"], Verdict::fail);
}

TEST(KernelRecordings, ThatAbutAreAsOneWhereverTheyDo) {
  const auto trace = trace_of(kRun);
  for (std::int64_t cut = kFirst; cut < kLast; ++cut) {
    const std::vector<Recorded> both{{.end = cut}, {.begin = cut + 1}};
    expect_same(recorded_as(trace, both), trace, cut);
  }
}

// As two snapshots of a flight recorder do: what both have happened once.
TEST(KernelRecordings, ThatOverlapAreAsOneWhereverTheyDo) {
  const auto trace = trace_of(kRun);
  for (std::int64_t cut = kFirst; cut < kLast; ++cut) {
    expect_same(recorded_as(trace, {{.end = cut + 9}, {.begin = cut}}), trace, cut);
    expect_same(recorded_as(trace, {{}, {.begin = cut, .end = cut + 19}}), trace, cut);
  }
}

// What the second one lost is in the first.
TEST(KernelRecordings, LoseNothingThatAnotherOneHas) {
  auto trace = trace_of(std::string(kRun) + "\n48 discard kernel until=45 count=1");
  auto made = recorded_as(trace, {{}, {.begin = 8}});
  std::erase_if(made.events, [](const Event& event) {
    return std::holds_alternative<Discarded>(event.body) &&
           static_cast<std::uint32_t>(event.head.stream) < 200;
  });
  EXPECT_EQ(rows_of(made)[1].execution, Duration{8});
  EXPECT_EQ(Verified(made, kSpec)["R4"], Verdict::fail);
  made = recorded_as(trace, {{.end = 30}, {.begin = 8}});
  EXPECT_FALSE(rows_of(made)[1].execution) << "the first one is over";
}

TEST(KernelRecordings, WithTimeBetweenThemCostWhatNeedsIt) {
  const auto trace = trace_of(kRun);
  const auto made = recorded_as(trace, {{.end = 25}, {.begin = 35}});
  const auto rows = rows_of(made);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].execution, Duration{6});
  EXPECT_EQ(rows[1].execution, Duration{8});
  EXPECT_EQ(rows[1].waking, Timestamp{40});
  const Verified verified(made, kSpec);
  EXPECT_EQ(verified["R4"], Verdict::fail);
  EXPECT_EQ(verified["S5"], Verdict::fail);
  // 2 ns before and 2 behind the first instance; 1 before and 10 behind the second.
  EXPECT_EQ(verified["M6"], Verdict::fail)
      << "what was seen is above, whatever the time between hides";
  EXPECT_THAT(verified.evidence("M6", "thread 101"),
              HasSubstr("at least 15 ns on a CPU outside callbacks within 140 ns"));
  const Verified allowed(made,
                         "callback_groups:\n  - {id: fusion, foreign_work_budget: 200000000}\n");
  EXPECT_EQ(allowed["M6"], Verdict::inconclusive) << "of the time between nobody knows";
  EXPECT_THAT(allowed.evidence("M6", "thread 101"),
              HasSubstr("until another recording's begins at 35"));
  EXPECT_EQ(verified["S3"], Verdict::pass);
  EXPECT_THAT(verified.evidence("S3", "thread 101"), HasSubstr("by read-back"));
  EXPECT_FALSE(busy_of(verified.result, 101));
}

TEST(KernelRecordings, WithTimeBetweenThemMeasureNoInstanceAcrossIt) {
  const auto rows = rows_of(recorded_as(trace_of(kRun), {{.end = 44}, {.begin = 47}}));
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].execution, Duration{6});
  EXPECT_FALSE(rows[1].execution);
}

// Which thread runs when a recording begins is news, no contradiction to the one before.
TEST(KernelRecordings, WithTimeBetweenThemLoseNoSwitch) {
  const auto made = recorded_as(trace_of(kRun), {{.end = 15}, {.begin = 35}});
  EXPECT_FALSE(has_switch_mismatch(Verified(made, kSpec)));
  const auto rows = rows_of(made);
  EXPECT_FALSE(rows[0].execution) << "it ended between them";
  EXPECT_EQ(rows[1].execution, Duration{8});
}

// CPU 1 has a record from 30 on: where `roams` ran before, nobody knows.
TEST(KernelRecordings, WithoutACpuMeasureNothingThatMayHaveRunThere) {
  const auto trace = trace_of(R"(
    callback stays
    callback roams
    10 switch 0 idle stays
    11 start stays
    17 end stays
    18 switch 0 stays roams state=1
    20 start roams
    22 switch 0 roams idle state=0
    24 switch 0 idle roams
    26 end roams
    27 switch 0 roams idle state=1
    50 switch 0 idle roams
    51 start roams
    52 switch 0 roams idle state=0
    53 switch 1 idle roams
    55 switch 1 roams idle state=0
    56 switch 0 idle roams
    59 end roams
    60 switch 0 roams idle state=1)");
  const auto rows = rows_of(recorded_as(trace, {{.end = 29, .cpu = 0}, {.begin = 30}}));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].execution, Duration{6}) << "it never left CPU 0";
  EXPECT_FALSE(rows[1].execution);
  EXPECT_EQ(rows[2].execution, Duration{6});  // 1 + 2 + 3
  const auto whole = rows_of(recorded_as(trace, {{.end = 29}, {.begin = 30}}));
  EXPECT_EQ(whole[1].execution, Duration{4});
}

// The thread is at priority 9 in place of 19 from 5 to 19, and lives from -100 on.
TEST(KernelRecordings, WithoutInheritanceMatterWhereNoOtherOneTellsOfIt) {
  const auto trace = trace_of(R"(
    callback fusion
    thread rcu worker silent tid=7
    -500 switch 0 idle rcu
    -499 switch 0 rcu idle state=1
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    5 switch 0 idle fusion next_prio=9
    12 start fusion
    18 end fusion
    19 switch 0 fusion idle state=1 prio=9
    500 switch 0 idle rcu
    501 switch 0 rcu idle state=1)");
  const auto judged = [&trace](const Recorded& told, Recorded untold) {
    untold.has_inheritance = false;
    return Verified(recorded_as(trace, {told, untold}))["S3"];
  };
  EXPECT_EQ(judged({}, {.end = -400}), Verdict::fail);
  EXPECT_EQ(judged({}, {.begin = 400}), Verdict::fail);
  EXPECT_EQ(judged({}, {}), Verdict::fail);
  EXPECT_EQ(judged({.begin = -85}, {.end = -50}), Verdict::inconclusive)
      << "somebody waited for it before, perhaps";
  EXPECT_EQ(judged({.begin = 10}, {}), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test::kernel_recordings
