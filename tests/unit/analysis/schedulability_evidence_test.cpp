// What bounds rest on: what a recording lacks guarantees no deadline, and what it shows explains.
#include <cie/analysis/schedulability.hpp>

#include "support/trace_text.hpp"
#include "task_system.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kSystem = R"(
    callback lo timer period=100 deadline=40 cpu=0
    callback hi subscription topic=/x cpu=0
    1 initial lo
    2 initial hi
    3 applied lo policy=fifo priority=10 cpus=0
    4 applied hi policy=fifo priority=50 cpus=0
    99 switch 0 idle lo
    100 start lo release=100
    110 end lo
    111 switch 0 lo idle
    149 switch 0 idle hi
    150 start hi release=150
    170 end hi
    171 switch 0 hi idle
    )";

// hi, with C = 20, is released 25 apart: lo, with C = 10, responds in 10 + 2 * 20 at worst.
std::string close_releases(const std::string& release) {
  return std::string(kSystem) + R"(
    174 switch 0 idle hi
    175 start hi release=)" +
         release + R"(
    195 end hi
    196 switch 0 hi idle
    269 switch 0 idle hi
    270 start hi release=270
    290 end hi
    291 switch 0 hi idle
    369 switch 0 idle hi
    370 start hi release=370
    390 end hi
    391 switch 0 hi idle)";
}

CallbackSchedulability of(const test::TextTrace& trace, const std::string& id,
                          const std::string& spec_text = {}, const AnalysisOptions& options = {}) {
  const auto report = test::analyze(trace, options).report;
  const auto spec = SchedulingSpec::parse("callback_groups: [" + spec_text + "]\n", "spec.yaml");
  const auto result = schedulability_of(report, &spec);
  const auto found = std::ranges::find(result.callbacks, id, &CallbackSchedulability::logical_id);
  if (found == result.callbacks.end()) throw std::invalid_argument(id);
  return *found;
}

void expect_undecided(const CallbackSchedulability& callback, const std::string& reason) {
  EXPECT_EQ(callback.bound_ns, std::nullopt);
  EXPECT_EQ(callback.meets_deadline(), std::nullopt);
  EXPECT_THAT(callback.reason, HasSubstr(reason));
}

TEST(SchedulabilityEvidence, IsWholeWhereEveryRunIsKnown) {
  const auto lo = of(test::trace_of(close_releases("175")), "lo");
  EXPECT_EQ(lo.bound_ns, 10 + 2 * 20);
  EXPECT_EQ(lo.meets_deadline(), false);
}

TEST(SchedulabilityEvidence, DecidesNothingBesideReleasesThatAreNotKnown) {
  const auto trace = test::trace_of(close_releases("none"));
  expect_undecided(of(trace, "lo"),
                   "how often hi, which may preempt it, is released is not known, "
                   "because 2 of its 3 inter-arrival times are not known");
  expect_undecided(of(trace, "hi"), "its shortest inter-arrival time is not known");
  EXPECT_EQ(of(trace, "lo", "{id: hi, min_inter_arrival: 25}").meets_deadline(), false);
  EXPECT_EQ(of(trace, "lo", "{id: hi, min_inter_arrival: 100}").meets_deadline(), true);
}

// Of the runs from 150, 175, 270 and 370 on, no one told when the last was released.
TEST(SchedulabilityEvidence, CountsTheInterArrivalTimesThatAreNotKnown) {
  auto text = close_releases("175");
  text.replace(text.find("release=370"), 11, "release=none");
  expect_undecided(of(test::trace_of(text), "hi"), "1 of its 3 inter-arrival times is not known");
}

TEST(SchedulabilityEvidence, DecidesNothingBesideRunsThatAreMissing) {
  auto trace = test::trace_of(close_releases("175"));
  const auto is_second = [](const auto& event, const EventHead&) { return event.seq == 1; };
  trace.erase<CallbackStart>(is_second);
  trace.erase<CallbackEnd>(is_second);
  expect_undecided(of(trace, "lo"), "instances of it are missing from the recording");
  expect_undecided(
      of(trace, "lo", "{id: hi, wcet: 20, min_inter_arrival: 100}"),
      "how long hi, which may preempt it, waits within an instance is not known, because instances "
      "of it are missing from the recording; record without losses");
}

// A stream ends at 200: what follows was recorded in part only, and is not measured.
TEST(SchedulabilityEvidence, DecidesNothingBesideRunsThatNotAllStreamsCover) {
  auto trace = test::trace_of(close_releases("175"));
  const auto begin = *std::ranges::find_if(trace.events, [](const Event& event) {
    return std::holds_alternative<StreamBegin>(event.body) &&
           std::get<StreamBegin>(event.body).domain == Domain::user;
  });
  const auto add = [&](Timestamp time, const EventBody& body) {
    trace.events.push_back(
        {.head = {.time = time, .stream = StreamIndex{20}, .cpu = 1, .pid = {}, .tid = {}},
         .body = body});
  };
  add(begin.head.time, begin.body);
  add(begin.head.time, PacketBegin{});
  add({50}, OtherEvent{});
  add({200}, PacketEnd{});
  add({200}, StreamEnd{});
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  expect_undecided(of(trace, "hi"), "2 of its instances lie outside of what all streams cover");
}

TEST(SchedulabilityEvidence, DecidesNothingBesideACallbackThatNobodySaw) {
  auto trace = test::trace_of(close_releases("175"));
  const auto is_hi = [](const auto&, const EventHead& head) { return head.time.ns >= 150; };
  trace.erase<CallbackStart>(is_hi);
  trace.erase<CallbackEnd>(is_hi);
  trace.erase<CallbackInit>(
      [](const CallbackInit& init, const EventHead&) { return init.logical_id == "hi"; });
  trace.erase<CallbackFini>(
      [](const CallbackFini& fini, const EventHead&) { return fini.started == 4; });
  const auto lo = of(trace, "lo");
  expect_undecided(lo,
                   "callbacks of pid 100, one of which may preempt it, may be missing from the "
                   "recording; record without losses");
  EXPECT_THAT(lo.reason, Not(HasSubstr("until"))) << "it has ended";
}

// Nothing counts the callbacks of an application that goes on.
TEST(SchedulabilityEvidence, SaysThatALossMayHaveTakenACallback) {
  const auto trace = test::trace_of("    process app crash\n" + std::string(kSystem) + R"(
    180 discard user until=190 count=9)");
  expect_undecided(of(trace, "lo", "{id: lo, wcet: 10, min_inter_arrival: 100}"),
                   "instances of it are missing from the recording; record without losses");
}

TEST(SchedulabilityEvidence, DecidesNothingBesideARunThatDidNotEnd) {
  const auto trace = test::trace_of(std::string(kSystem) + R"(
    249 switch 0 idle hi
    250 start hi release=250
    300 switch 0 hi idle)");
  expect_undecided(of(trace, "lo"), "1 of its instances did not end in the recording");
}

// An application outlives its recording, which ends 1 after `last`; hi has run since 470.
test::TextTrace running_at_end(const std::string& last) {
  return test::trace_of("    process app crash\n" + close_releases("175") + R"(
    469 switch 0 idle hi
    470 start hi release=470
    )" + last + R"( waking lo)");
}

TEST(SchedulabilityEvidence, TakesForExecutionWhatWasSeenOfTheRunInProgress) {
  EXPECT_EQ(of(running_at_end("489"), "lo").bound_ns, 10 + 2 * 20);
  expect_undecided(of(running_at_end("490"), "lo"),
                   "1 of its instances did not end in the recording");
}

// hi was released every 100 until the run in progress, 25 after the last one.
TEST(SchedulabilityEvidence, CountsTheReleaseOfTheRunInProgress) {
  const auto hi = of(test::trace_of("    process app crash\n" + std::string(kSystem) + R"(
    174 switch 0 idle hi
    175 start hi release=175
    180 waking lo)"),
                     "hi");
  ASSERT_TRUE(hi.period);
  EXPECT_EQ(hi.period->ns, 25);
}

// hi became less urgent than lo after its first run, which a lost read-back alone tells.
TEST(SchedulabilityEvidence, DecidesNothingBesideReadBacksThatAreMissing) {
  auto trace = test::trace_of(std::string(kSystem) + R"(
    180 applied hi policy=fifo priority=5 cpus=0
    269 switch 0 idle hi
    270 start hi release=270
    290 end hi
    291 switch 0 hi idle)");
  const std::string spec = "{id: hi, wcet: 20, min_inter_arrival: 100}";
  EXPECT_EQ(of(trace, "lo", spec).bound_ns, 10 + 20) << "as urgent as it ever was";
  trace.erase<ThreadSched>(
      [](const ThreadSched&, const EventHead& head) { return head.time.ns == 4; });
  expect_undecided(of(trace, "lo", spec), "read-backs of the parameters of thread 102 are missing");
  expect_undecided(of(trace, "hi", spec), "read-backs of the parameters of thread 102 are missing");
}

// Released every 100, it executes for 10 from the next moment on.
TEST(SchedulabilityEvidence, NeedsNoReleaseOfRunsThatAnEdgeCuts) {
  std::string text = R"(
    callback lo subscription topic=/x deadline=40 cpu=0
    1 initial lo
    3 applied lo policy=fifo priority=10 cpus=0)";
  for (int release = 100; release <= 400; release += 100) {
    const auto at = [release](int after) { return '\n' + std::to_string(release + after); };
    text += at(0) + " switch 0 idle lo" + at(1) + " start lo release=" + std::to_string(release) +
            at(11) + " end lo" + at(12) + " switch 0 lo idle state=1";
  }
  AnalysisOptions options;
  options.window = TimeWindow{.from = {105}, .to = {405}};
  const auto lo = of(test::trace_of(text), "lo", {}, options);
  EXPECT_EQ(lo.runs, 2U) << "those of 200 and 300";
  EXPECT_EQ(lo.period->ns, 100);
  EXPECT_EQ(lo.bound_ns, 10);
  EXPECT_EQ(lo.meets_deadline(), true);
}

// A hole in the kernel's record hides what the second run of hi executed: no more than it took.
TEST(SchedulabilityEvidence, TakesForExecutionWhatARunMayHaveExecuted) {
  const auto with_hole = [](const std::string& end) {
    return test::trace_of(std::string(kSystem) + R"(
    249 switch 0 idle hi
    250 start hi release=250
    251 discard kernel until=252
    )" + end + R"( end hi
    299 switch 0 hi idle)");
  };
  EXPECT_EQ(of(with_hole("270"), "lo").bound_ns, 10 + 20);
  EXPECT_EQ(of(with_hole("270"), "lo").meets_deadline(), true);
  expect_undecided(
      of(with_hole("271"), "lo"),
      "the longest execution time of hi, which may preempt it, is not known, because an "
      "instance that took longer was not measured; declare wcet in the spec");
  expect_undecided(of(with_hole("271"), "hi"), "its longest execution time is not known");
}

TEST(SchedulabilityEvidence, SaysThatARunMayHaveTakenLonger) {
  const auto hi = of(test::trace_of(close_releases("none")), "hi");
  EXPECT_EQ(hi.observed_ns, 20);
  EXPECT_TRUE(hi.may_have_taken_longer);
  EXPECT_FALSE(of(test::trace_of(close_releases("175")), "hi").may_have_taken_longer);
}

// The bound of `high` is 3, an instance took 5, and the kernel may have taken 3 of that.
SchedulabilityReport exceeded(const std::string& declared) {
  auto system = textbook();
  auto& high = system.report.callbacks[0];
  high.response_time = extremes(0, 5);
  high.wakeup_latency = extremes(0, 3);
  auto result = system.analyzed("callback_groups:\n  - {id: high, " + declared + "}\n");
  EXPECT_EQ(result.callbacks[0].bound_ns, 3);
  return result;
}

TEST(SchedulabilityEvidence, AddsToABoundThatWasExceededWhatExplainsThat) {
  auto result = exceeded("response_deadline: 6");
  EXPECT_EQ(result.callbacks[0].meets_deadline(), true) << "3 + 3 is within 6";
  EXPECT_EQ(result.callbacks[0].reason, "");
  EXPECT_FALSE(result.has_finding());

  result = exceeded("response_deadline: 5");
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt) << "3 + 3 is beyond 5";
  EXPECT_FALSE(result.has_finding()) << "it is explained";
  EXPECT_TRUE(result.is_undecided());
  EXPECT_THAT(result.why_undecided(), HasSubstr("the bound is beyond the deadline"));
  EXPECT_EQ(result.callbacks[0].reason, result.why_undecided());
}

TEST(SchedulabilityEvidence, GuaranteesNothingByADeclarationThatWasNotKept) {
  auto system = textbook();
  auto& high = system.report.callbacks[0];  // it executed for 3
  high.response_time = extremes(0, 3);
  const auto result =
      system.analyzed("callback_groups:\n  - {id: high, wcet: 2, response_deadline: 50}\n");
  EXPECT_EQ(result.callbacks[0].bound_ns, 2);
  EXPECT_FALSE(result.callbacks[0].is_flagged) << "an overrun of 1 explains it";
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("a declaration that was not kept"));
}

// The declarations of `high` were not kept: others' bounds rest on them, too.
TEST(SchedulabilityEvidence, GuaranteesNothingByARivalsDeclarationThatWasNotKept) {
  for (const auto* declared : {"wcet: 2", "min_inter_arrival: 8"}) {
    auto system = textbook();
    system.report.callbacks[1].response_time = extremes(0, 5);
    const auto result = system.analyzed(std::string("callback_groups:\n  - {id: high, ") +
                                        declared + "}\n  - {id: mid, response_deadline: 50}\n");
    EXPECT_TRUE(result.callbacks[1].bound_ns) << declared;
    EXPECT_EQ(result.callbacks[1].meets_deadline(), std::nullopt) << declared;
    EXPECT_THAT(result.callbacks[1].reason, HasSubstr("declaration that was not kept: "));
  }
  const auto kept = textbook().analyzed(
      "callback_groups:\n  - {id: high, wcet: 3, min_inter_arrival: 7}\n"
      "  - {id: mid, response_deadline: 50}\n");
  EXPECT_EQ(kept.callbacks[1].meets_deadline(), true);
}

// A wcet is execution time: what `hi` waits within its runs of 20 is not in it.
TEST(SchedulabilityEvidence, DecidesNothingBesideWaitingThatWasNotMeasured) {
  auto trace = test::trace_of(kSystem + std::string("\n250 start hi release=250\n270 end hi"));
  trace.erase<SchedSwitch>();
  const auto spec = [](const std::string& wcet) {
    return "{id: lo, wcet: 10}, {id: hi, min_inter_arrival: 100, wcet: " + wcet + "}";
  };
  EXPECT_EQ(of(trace, "lo", spec("20")).bound_ns, 10 + 20) << "no run took longer";
  expect_undecided(
      of(trace, "lo", spec("19")),
      "how long hi, which may preempt it, waits within an instance is not known, because an "
      "instance that took longer than its wcet was not measured; record with --kernel");
  expect_undecided(of(trace, "hi", spec("19")),
                   "how long it waits within an instance is not known");
}

// Linux may postpone the deadline of a server whose job waits, however short.
TEST(SchedulabilityEvidence, BoundsNoServerOfWhichWaitingWasNotMeasured) {
  TaskSystem system;
  auto& callback = system.add(
      "server", {.execution = 2, .inter_arrival = 20, .response = 4, .policy = Policy::deadline});
  auto& sched = system.sched(0);
  sched.runtime_ns = 4;
  sched.deadline_ns = sched.period_ns = 10;
  EXPECT_TRUE(system.analyzed().callbacks[0].bound_ns);
  callback.longest_unmeasured = Duration{1};
  expect_undecided(system.analyzed().callbacks[0], "whether it waits within an instance");
}

// Read back was CPU 1, and the kernel saw `hi` on CPU 0, where `lo` runs.
TEST(SchedulabilityEvidence, DecidesNothingWhereTheKernelShowsOtherParameters) {
  const std::string spec = "{id: hi, wcet: 20, min_inter_arrival: 100}";
  auto text = std::string(kSystem);
  const std::string read_back = "applied hi policy=fifo priority=50 cpus=0";
  text.replace(text.find(read_back), read_back.size(), "applied hi policy=fifo priority=50 cpus=1");
  const auto lo = of(test::trace_of(text), "lo", spec);
  expect_undecided(lo, "the kernel shows thread 102 with other parameters than were read back");
}

// Totals count 20 instances of `hi`, which ended before the recording began.
TEST(SchedulabilityEvidence, DecidesNothingBesideACallbackThatRanBefore) {
  auto system = textbook();
  auto& high = system.report.callbacks[0];
  high.threads.clear();
  high.execution_time.reset();
  high.inter_arrival.reset();
  high.response_time.reset();
  high.isolation = Isolation::never_ran;
  EXPECT_TRUE(system.analyzed().callbacks[1].bound_ns) << "it never ran";
  high.runs_not_seen = 20;
  const auto result = system.analyzed();
  expect_undecided(result.callbacks[1], "all instances of high, which may preempt it, are missing");
  EXPECT_EQ(result.callbacks[0].reason, "none of its instances is in the recording");
  system.report.trace.begin = Timestamp{100};
  system.report.trace.end = Timestamp{200};
  system.report.trace.recording_begin = Timestamp{0};
  const auto in_window = system.analyzed();
  expect_undecided(in_window.callbacks[1],
                   "all instances of high, which may preempt it, lie outside the window");
  EXPECT_EQ(in_window.callbacks[0].reason, "none of its instances is in the window");
  high.may_lack_runs = true;
  expect_undecided(system.analyzed().callbacks[1], "are missing from the recording");
}

TEST(SchedulabilityEvidence, GuaranteesNothingByABoundThatWasExceededWithoutExplanation) {
  auto system = textbook();
  system.report.callbacks[0].response_time = extremes(0, 5);
  const auto result = system.analyzed("callback_groups:\n  - {id: high, response_deadline: 50}\n");
  EXPECT_TRUE(result.callbacks[0].is_flagged);
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("nothing known explains all of that"));
}

// No release is known. It executes for 500 and is blocked for 200; then it wakes up for 3000.
TEST(SchedulabilityEvidence, ExplainsByTheLongestPartsWhereTheLongestRunHasNoRelease) {
  const auto lo = of(test::trace_of(R"(
    callback lo subscription topic=/x cpu=0
    1 initial lo
    3 applied lo policy=fifo priority=10 cpus=0
    99 switch 0 idle lo
    100 start lo release=none
    300 switch 0 lo idle state=1
    500 waking lo
    3500 switch 0 idle lo
    3800 end lo
    3810 switch 0 lo idle state=1)"),
                     "lo", "{id: lo, wcet: 600, min_inter_arrival: 9000, response_deadline: 3799}");
  EXPECT_EQ(lo.bound_ns, 600 + 200);
  EXPECT_EQ(lo.observed_ns, std::nullopt);
  EXPECT_EQ(lo.longest_ns(), 3700);
  EXPECT_THAT(lo.explanations, ElementsAre(Field(&Explanation::ns, 3000)));
  EXPECT_FALSE(lo.is_flagged);
  EXPECT_EQ(lo.meets_deadline(), std::nullopt) << "800 + 3000 is beyond 3799";
}

// lo starts 20 after its release; the thread of hi preempts it for 500, its callback for 490 of
// these.
constexpr const char* kOverhead = R"(
    callback lo timer period=10000 cpu=0
    callback hi timer period=10000 cpu=0
    1 initial lo
    2 initial hi
    3 applied lo policy=fifo priority=10 cpus=0
    4 applied hi policy=fifo priority=50 cpus=0
    110 switch 0 idle lo
    120 start lo release=100
    1100 preempt lo by=hi
    1105 start hi release=1095
    1595 end hi
    1600 switch 0 hi lo
    )";

TEST(SchedulabilityEvidence, ExplainsByWhatThreadsOfTheModelRunBesideTheirCallbacks) {
  const auto lo = of(test::trace_of(std::string(kOverhead) + R"(
    3100 end lo
    3105 switch 0 lo idle)"),
                     "lo");
  EXPECT_EQ(lo.bound_ns, 2480 + 490);
  EXPECT_EQ(lo.observed_ns, 3000);
  EXPECT_THAT(lo.explanations,
              ElementsAre(Field(&Explanation::ns, 500 - 490), Field(&Explanation::ns, 20)));
  EXPECT_FALSE(lo.is_flagged);
}

// The release of its second run is not known, and so nobody knows that it came too soon. Of what its
// thread ran outside callbacks all but 20 was after lo had ended.
TEST(SchedulabilityEvidence, DoesNotExplainByWorkThatPreemptedIt) {
  const auto lo = of(test::trace_of(std::string(kOverhead) + R"(
    1700 preempt lo by=hi
    1705 start hi release=none
    2195 end hi
    2200 switch 0 hi lo
    3600 end lo
    3605 switch 0 lo idle
    4000 switch 0 idle hi
    9000 switch 0 hi idle)"),
                     "lo", "{id: hi, wcet: 490, min_inter_arrival: 10000}");
  EXPECT_EQ(lo.bound_ns, 2480 + 490);
  EXPECT_EQ(lo.observed_ns, 3500);
  EXPECT_THAT(lo.explanations,
              ElementsAre(Field(&Explanation::ns, 20), Field(&Explanation::ns, 20)));
  EXPECT_TRUE(lo.is_flagged);
}

// hi executes for 490.
TEST(SchedulabilityEvidence, ExplainsByTheDeclarationOfAnotherThatWasNotKept) {
  const auto lo = of(test::trace_of(std::string(kOverhead) + R"(
    3100 end lo
    3105 switch 0 lo idle)"),
                     "lo", "{id: hi, wcet: 100}, {id: lo, response_deadline: 5000}");
  EXPECT_EQ(lo.bound_ns, 2480 + 100);
  EXPECT_EQ(lo.observed_ns, 3000);
  const auto text =
      "an instance of hi, which its bound counts, executed 0.4 us, declared are 0.1 us";
  EXPECT_THAT(lo.explanations.at(0), Field(&Explanation::text, text));
  EXPECT_EQ(lo.explanations[0].ns, 490 - 100);
  EXPECT_EQ(lo.explanations.at(1).ns, 500 - 490) << "outside its callback";
  EXPECT_FALSE(lo.is_flagged);
  EXPECT_EQ(lo.meets_deadline(), std::nullopt);
  EXPECT_THAT(lo.reason, HasSubstr("was not kept: an instance of hi executed 0.4 us"));
}

// There is no spec, and hi runs a second time 600 after its first one.
TEST(SchedulabilityEvidence, ExplainsByATimerWhosePeriodWasNotKept) {
  const auto lo = of(test::trace_of(std::string(kOverhead) + R"(
    1700 preempt lo by=hi
    1705 start hi release=1695
    2195 end hi
    2200 switch 0 hi lo
    3600 end lo
    3605 switch 0 lo idle)"),
                     "lo");
  EXPECT_EQ(lo.bound_ns, 2480 + 490);
  EXPECT_EQ(lo.observed_ns, 3500);
  EXPECT_THAT(lo.explanations.at(0).text,
              "releases of hi, which its bound counts, came 0.6 us apart, declared are 10.0 us");
  EXPECT_FALSE(lo.is_flagged);
}

// Its execution of 490 adds 390 to the bound, twice 390 were more.
TEST(SchedulabilityEvidence, ExplainsNoMoreByADeclarationThanItsBreachMayTake) {
  const auto lo = of(test::trace_of(std::string(kOverhead) + R"(
    1700 preempt lo by=hi
    1705 start hi release=none
    2195 end hi
    2200 switch 0 hi lo
    3600 end lo
    3605 switch 0 lo idle)"),
                     "lo", "{id: hi, wcet: 100, min_inter_arrival: 10000}");
  EXPECT_EQ(lo.bound_ns, 2480 + 100);
  EXPECT_EQ(lo.observed_ns, 3500);
  EXPECT_EQ(lo.explanations.at(0).ns, 490 - 100);
  EXPECT_TRUE(lo.is_flagged);
}

}  // namespace
}  // namespace cie::analysis
