#include "support/move_to_host.hpp"
#include "support/verdicts.hpp"
#include "timer_runs.hpp"
#include "windows.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Deadline, ComparesTheLongestResponseTimeExactly) {
  EXPECT_EQ(Verified(kTwoRuns, spec("response_deadline: 8"))["R3"], Verdict::pass);
  const Verified verified(kTwoRuns, spec("response_deadline: 7"));
  EXPECT_EQ(verified.of("R3", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R3", "callback fusion"),
              AllOf(HasSubstr("22 callback_start seq 1 starts, released at 20"),
                    HasSubstr("28 callback_end response time 8 ns, the deadline of "
                              "spec.yaml:2 is 7 ns")));
}

// Behind the start, and behind the end; nothing else tells of it.
TEST(Deadline, TakesAReleaseBehindTheStartForUnknown) {
  for (const auto* release : {"23", "33"}) {
    auto text = std::string(kTwoRuns);
    text.replace(text.find("release=20"), 10, std::string("release=") + release);
    const Verified verified(text, spec("response_deadline: 8\n    min_inter_arrival: 1"));
    for (const auto* rule : {"R1", "R2", "R3", "R5"})
      EXPECT_EQ(verified.of(rule, "callback fusion"), Verdict::inconclusive) << rule << release;
    const auto& report = callback(verified, "fusion");
    EXPECT_EQ(report.response_time->count, 1U);
    EXPECT_EQ(report.response_time->min, 15 - 10);
    EXPECT_EQ(report.start_latency->min, 12 - 10);
    EXPECT_EQ(report.response_time_lower->min, 28 - 22) << "its duration";
  }
}

TEST(Deadline, FallsBackToTheDeclaredOne) {
  auto text = std::string(kTwoRuns);
  text.replace(text.find("period=10"), 9, "period=10 deadline=7");
  EXPECT_EQ(Verified(text)["R3"], Verdict::fail);
  EXPECT_EQ(Verified(text, spec("response_deadline: 8"))["R3"], Verdict::pass);
  EXPECT_EQ(Verified(kTwoRuns)["R3"], Verdict::not_applicable);
}

// Response times 5 and 8.
TEST(Deadline, IsInTheReportWithTheNumberOfInstancesBeyondIt) {
  auto declared = std::string(kTwoRuns);
  declared.replace(declared.find("period=10"), 9, "period=10 deadline=7");
  const auto row = [](const Verified& verified) { return verified.result.report.callbacks.at(0); };
  EXPECT_EQ(row(Verified(declared)).response_deadline, Duration{7});
  EXPECT_EQ(row(Verified(declared)).late, 1U);
  EXPECT_EQ(row(Verified(declared, spec("response_deadline: 4"))).response_deadline, Duration{4});
  EXPECT_EQ(row(Verified(declared, spec("response_deadline: 4"))).late, 2U);
  EXPECT_EQ(row(Verified(declared, spec("response_deadline: 8"))).late, 0U);
  EXPECT_FALSE(row(Verified(kTwoRuns)).response_deadline || row(Verified(kTwoRuns)).late);
}

TEST(Deadline, DoesNotTakeASecondEndForTheFirst) {
  auto trace = trace_of(R"(
    callback fusion timer period=10
    12 start fusion release=10
    14 end   fusion
    19 end   fusion                  # again: E1
    22 start fusion release=20
    24 end   fusion)");
  EXPECT_EQ(Verified(trace, spec("response_deadline: 5"))["R3"], Verdict::pass);
  bool is_first = true;
  trace.erase<analysis::CallbackEnd>(
      [&](const auto&, const auto&) { return std::exchange(is_first, false); });
  EXPECT_EQ(Verified(trace, spec("response_deadline: 5"))["R3"], Verdict::inconclusive)
      << "the end at 19 may be the second one";
  EXPECT_EQ(Verified(trace, spec("wcet: 5"))["R4"], Verdict::inconclusive);
}

TEST(Deadline, UsesBothBoundsWhereTheReleaseIsUnknown) {
  // Only the wake-up at 11 is known: the response time is at least 9, and maybe more.
  constexpr auto kWoken = R"(
    callback fusion subscription
    11 wakeup fusion
    12 start fusion release=none
    20 end fusion)";
  const Verified late(kWoken, spec("response_deadline: 8"));
  EXPECT_EQ(late["R3"], Verdict::fail);
  EXPECT_THAT(late.evidence("R3", "callback fusion"),
              AllOf(HasSubstr("seq 0 starts, released at 11 at the latest"),
                    HasSubstr("response time at least 9 ns")));
  const Verified undecided(kWoken, spec("response_deadline: 100"));
  EXPECT_EQ(undecided["R3"], Verdict::inconclusive);
  EXPECT_THAT(undecided.evidence("R3", "callback fusion"),
              HasSubstr("1 instance without an upper bound of the response time"));
}

// The kernel shows who was woken up, not for what: here it is a lock, and the instance is released while its thread is
// busy. Of a wait that the executor had, its thread_wakeup tells.
TEST(Deadline, DoesNotTakeAWakeUpThatEndedNoWaitForTheRelease) {
  const auto woken_for = [](const std::string& thread_wakeup) {
    return Verified(R"(
    callback fusion
    kernel
    0 switch 0 idle fusion
    1 wakeup fusion
    2 start fusion release=none
    5 end fusion
    7 switch 0 fusion idle state=1
    10 waking fusion
    11 switch 0 idle fusion
    )" + thread_wakeup + R"(
    60 start fusion release=none
    62 end fusion
    64 switch 0 fusion idle state=1)",
                    spec("response_deadline: 20"));
  };
  EXPECT_EQ(woken_for("")["R3"], Verdict::inconclusive);
  EXPECT_EQ(woken_for("12 wakeup fusion")["R3"], Verdict::fail) << "62 - 10";
}

TEST(Deadline, TakesTheSourceTimestampAsUpperBound) {
  // Written at 5, started at 12, ended at 20: between 8 and 15.
  constexpr auto kWritten = R"(
    publisher out
    callback plan pooled
    thread t1 pool
    callback fusion subscription pooled
    4 start plan on=t1
    5 publish out on=t1
    6 end plan on=t1
    12 start fusion from=out:0 on=t1
    20 end fusion on=t1)";
  const Verified late(kWritten, spec("response_deadline: 7"));
  EXPECT_EQ(late["R3"], Verdict::fail);
  EXPECT_THAT(late.evidence("R3", "callback fusion"),
              AllOf(HasSubstr("seq 0 starts, released at 5 at the earliest"),
                    HasSubstr("response time at least 8 ns")));
  EXPECT_EQ(Verified(kWritten, spec("response_deadline: 14"))["R3"], Verdict::inconclusive);
  EXPECT_EQ(Verified(kWritten, spec("response_deadline: 15"))["R3"], Verdict::pass);
}

// What woke the thread at 6 was overwritten by what is written at 200000: between 100000 and 200000, and not
// 299994. Nearer to each other the two may be one, for readings of the clocks differ.
TEST(Deadline, TakesNoWakeUpForTheReleaseOfALaterMessage) {
  constexpr auto kOverwritten = R"(
    publisher out
    callback plan pooled
    thread t1 pool
    callback fusion subscription
    4 start plan on=t1
    6 wakeup fusion
    200000 publish out on=t1
    200001 end plan on=t1
    300000 start fusion from=out:0 release=none
    400000 end fusion)";
  EXPECT_EQ(Verified(kOverwritten, spec("response_deadline: 99999"))["R3"], Verdict::fail);
  EXPECT_EQ(Verified(kOverwritten, spec("response_deadline: 199999"))["R3"], Verdict::inconclusive);
  EXPECT_EQ(Verified(kOverwritten, spec("response_deadline: 200000"))["R3"], Verdict::pass);
}

// Not known to be that of the message that is taken: its writer is not.
TEST(Deadline, TakesNoWakeUpForTheReleaseOfAMessageOfAnUnknownWriter) {
  auto trace = trace_of(R"(
    publisher out
    thread t1 pool
    callback fusion subscription
    2 publish out on=t1
    6 wakeup fusion
    300000 start fusion from=out:0 release=none
    400000 end fusion)");
  EXPECT_EQ(Verified(trace, spec("response_deadline: 350000"))["R3"], Verdict::fail);
  trace.erase<PublisherInit>();
  EXPECT_EQ(Verified(trace, spec("response_deadline: 350000"))["R3"], Verdict::inconclusive);
}

// A message that is written at 5000 and taken by an instance from 1000000 to 1000010. CLOCK_REALTIME is
// set by `step` before it is written, or, if that is wanted, afterwards.
TextTrace written_by_a_clock_that_is_set(std::int64_t step, bool is_set_later = false) {
  auto trace = trace_of(R"(
    publisher out
    callback plan pooled
    thread t1 pool
    callback fusion subscription pooled
    4000 start plan on=t1
    5000 publish out on=t1
    6000 end plan on=t1
    1000000 start fusion from=out:0 on=t1
    1000010 end fusion on=t1)");
  for (auto& event : trace.events) {
    auto* publish = std::get_if<Publish>(&event.body);
    auto* start = std::get_if<CallbackStart>(&event.body);
    auto* sync = std::get_if<ClockSync>(&event.body);
    const bool is_set = !is_set_later;
    if (publish != nullptr && is_set) publish->source_timestamp_realtime_ns += step;
    if (start != nullptr && is_set && start->source_timestamp_realtime_ns != 0)
      start->source_timestamp_realtime_ns += step;
    if (sync != nullptr && event.head.time.ns > 0) sync->realtime_ns += step;
  }
  return trace;
}

// As a process reads it every second.
void add_clock_sync(TextTrace& trace, std::int64_t time, std::int64_t step) {
  const auto next = std::ranges::find_if(
      trace.events, [time](const Event& event) { return event.head.time.ns >= time; });
  const auto any = std::ranges::find_if(trace.events, [](const Event& event) {
    return std::holds_alternative<ClockSync>(event.body);
  });
  auto sync = *any;
  sync.head.time = {time};
  sync.body = ClockSync{.monotonic_ns = time, .realtime_ns = 1'000'000'000 + time + step};
  trace.events.insert(next, sync);
}

TEST(Deadline, TakesNoSourceTimestampOfAClockThatWasSetMeanwhile) {
  constexpr std::int64_t kStep = 500'000;
  const auto keeps = spec("response_deadline: 1000000");
  const auto misses = spec("response_deadline: 600000");
  EXPECT_EQ(Verified(written_by_a_clock_that_is_set(0), keeps)["R3"], Verdict::pass);
  EXPECT_EQ(Verified(written_by_a_clock_that_is_set(kStep), misses)["R3"], Verdict::inconclusive)
      << "it took up to 995010, and seems to have taken up to 495010";
  auto set_back = written_by_a_clock_that_is_set(-kStep, true);
  add_clock_sync(set_back, 200'000, -kStep);
  const Verified verified(set_back, misses);
  EXPECT_EQ(verified["R3"], Verdict::inconclusive);
  EXPECT_THAT(
      verified.evidence("R3", "callback fusion"),
      AllOf(HasSubstr("of 1 instance a message tells when it was written by CLOCK_REALTIME"),
            Not(HasSubstr("without an upper bound"))));
}

// Of a live system.
Verdict r3_so_far(const TextTrace& trace, const std::string& spec_text) {
  const auto spec = SchedulingSpec::parse(spec_text, "spec.yaml");
  AnalysisOptions options;
  options.spec = &spec;
  Analyzer analyzer(options);
  for (const auto& event : trace.events)
    analyzer.consume(event);
  const auto rules = analyzer.look().verdicts.rules;
  return std::ranges::find(rules, "R3", &RuleVerdict::id)->verdict;
}

TEST(Deadline, TakesASourceTimestampThatNoClockSyncSpeaksAgainst) {
  const auto keeps = spec("response_deadline: 1000000");
  auto trace = written_by_a_clock_that_is_set(0);
  trace.erase<ClockSync>([](const ClockSync&, const EventHead& head) { return head.time.ns > 0; });
  EXPECT_EQ(Verified(trace, keeps)["R3"], Verdict::pass);
  EXPECT_EQ(r3_so_far(trace, keeps), Verdict::pass);
  add_clock_sync(trace, 1'000'020, 0);
  EXPECT_EQ(Verified(trace, keeps)["R3"], Verdict::pass);
  trace.erase<ClockSync>([](const ClockSync&, const EventHead& head) { return head.time.ns > 0; });
  add_clock_sync(trace, 1'000'020, 500'000);
  EXPECT_EQ(Verified(trace, keeps)["R3"], Verdict::inconclusive);
}

// By then it is known what CLOCK_REALTIME was set to.
TEST(Deadline, TakesASourceTimestampThatWasWrittenAfterTheClockWasSet) {
  constexpr std::int64_t kStep = 500'000;
  auto trace = written_by_a_clock_that_is_set(kStep);
  add_clock_sync(trace, 3'000, kStep);
  EXPECT_EQ(Verified(trace, spec("response_deadline: 995010"))["R3"], Verdict::pass);
  EXPECT_EQ(Verified(trace, spec("response_deadline: 995009"))["R3"], Verdict::inconclusive);
}

TEST(Deadline, FailsForAnInstanceThatNeverEnded) {
  const auto text = std::string(kTwoRuns) + "\n42 start fusion release=40\n100 finish fusion";
  const Verified verified(text, spec("response_deadline: 20"));
  EXPECT_EQ(verified.of("R3", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R3", "callback fusion"), HasSubstr("and never ends"));
  EXPECT_EQ(Verified("process app crash\n" + text, spec("response_deadline: 20"))["R3"],
            Verdict::pass)
      << "one cut by a crash is not judged";
}

// What the recording of another machine, or of another process, covers is no time that passed for the instance.
TEST(Deadline, EndsWithTheWindowOfItsOwnChannel) {
  const auto text = std::string(kTwoRuns) + "\n42 start fusion release=40\n100 finish fusion";
  const auto late = trace_of("callback other\n9000 start other\n9010 end other");
  const auto judged = [&](const char* deadline, std::int64_t clock) {
    return Verified(
               beside(trace_of(text), late, {.name = "desk", .monotonic = clock, .realtime = 0}),
               spec(deadline))
        .of("R3", "callback fusion (pid 100 on robot)");
  };
  for (const std::int64_t clock : {0, 1'000'000, -1'000'000}) {
    EXPECT_EQ(judged("response_deadline: 20", clock), Verdict::fail) << clock;
    EXPECT_EQ(judged("response_deadline: 2000", clock), Verdict::inconclusive) << clock;
  }
}

TEST(Deadline, KeepsItsFailureUnderLoss) {
  auto trace = trace_of(kTwoRuns);
  drop_first_instance(trace);
  EXPECT_EQ(Verified(trace, spec("response_deadline: 7"))["R3"], Verdict::fail);
  EXPECT_EQ(Verified(trace, spec("response_deadline: 8"))["R3"], Verdict::inconclusive);
}

TEST(Budget, ComparesExecutionTimeNotDuration) {
  // Duration 10, of which 4 preempted.
  constexpr auto kPreempted = R"(
    callback fusion
    callback lidar
    5 switch 0 idle fusion
    10 start fusion release=9
    12 preempt fusion by=lidar
    16 switch 0 lidar fusion state=1
    20 end fusion
    25 switch 0 fusion idle state=1
    25 switch 1 idle lidar
    26 switch 1 lidar idle)";
  EXPECT_EQ(Verified(kPreempted, spec("wcet: 6"))["R4"], Verdict::pass);
  const Verified verified(kPreempted, spec("wcet: 5"));
  EXPECT_EQ(verified.of("R4", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R4", "callback fusion"), HasSubstr("execution time 6 ns"));
}

// The switches to lidar and back are lost without a count: fusion did not run meanwhile.
TEST(Budget, IsInconclusiveWhereAnotherThreadSpokeOnTheCpu) {
  constexpr auto kUnseen = R"(
    callback fusion
    callback lidar
    1 switch 0 idle lidar
    2 start lidar release=1
    3 end lidar
    4 switch 0 lidar idle state=1
    5 switch 0 idle fusion
    10 start fusion release=9
    13 start lidar release=12
    15 end lidar
    20 end fusion
    25 switch 0 fusion idle state=1)";
  const Verified verified(kUnseen, spec("wcet: 8"));
  EXPECT_EQ(verified.of("R4", "callback fusion"), Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T2", "trace"), HasSubstr("switch_mismatch"));
}

// Its switch-in is lost: of 10 ns it ran 2 before it left its CPU, and then at most until it ended.
constexpr const char* kReturnsUnseen = R"(
    callback fusion
    callback lidar
    5 switch 0 idle fusion
    10 start fusion release=9
    12 preempt fusion by=lidar
    20 end fusion
)";

TEST(Budget, IsInconclusiveWhereOnlyItsOwnEndShowsThatItRanAgain) {
  const std::string revealed = std::string(kReturnsUnseen) + "25 switch 0 fusion idle state=1";
  const auto verdict = [](const Verified& verified) {
    return verified.of("R4", "callback fusion");
  };
  EXPECT_EQ(verdict(Verified(revealed, spec("wcet: 9"))), Verdict::inconclusive);
  EXPECT_EQ(verdict(in_window(revealed, 1, 20, spec("wcet: 9"))), Verdict::inconclusive);
  EXPECT_EQ(verdict(in_window(revealed, 1, 22, spec("wcet: 9"))), Verdict::inconclusive);
  EXPECT_EQ(verdict(Verified(kReturnsUnseen, spec("wcet: 9"))), Verdict::inconclusive);
  EXPECT_EQ(verdict(in_window(revealed, 1, 20, spec("wcet: 10"))), Verdict::pass);
  const auto cut = in_window(revealed, 1, 20);
  EXPECT_FALSE(callback(cut, "fusion").execution_time);
  EXPECT_FALSE(callback(cut, "fusion").preempted);
}

TEST(Budget, TakesASwitchInOfTheNanosecondOfTheEndForSeen) {
  const std::string seen = std::string(kReturnsUnseen) + "20 switch 0 lidar fusion state=1";
  const Verified verified(seen, spec("wcet: 9"));
  EXPECT_EQ(verified.of("R4", "callback fusion"), Verdict::pass);
  EXPECT_EQ(callback(verified, "fusion").execution_time->max, 2);
  EXPECT_EQ(callback(verified, "fusion").preempted->max, 20 - 12);
}

// From 4 to 8 it may have run on CPU 0, unseen.
constexpr const char* kMayHaveMoved = R"(
    callback camera cpu=1
    callback lidar
    callback fusion
    0 switch 0 idle fusion
    1 switch 0 fusion idle state=1
    1 switch 1 idle camera
    2 start camera release=1
    3 switch 0 idle lidar
    4 switch 1 camera idle
    8 switch 1 idle camera
    10 end camera
    11 switch 1 camera idle state=1
)";
constexpr const char* kCamera = "callback_groups:\n  - {id: camera, wcet: 5}\n";

TEST(Budget, IsInconclusiveWhereASwitchBehindTheWindowTellsWhatWasHidden) {
  const std::string whole = std::string(kMayHaveMoved) + "12 switch 0 lidar idle state=1";
  EXPECT_EQ(in_window(whole, 1, 10, kCamera).of("R4", "callback camera"), Verdict::pass);
  const std::string holed = std::string(kMayHaveMoved) + "12 switch 0 camera idle state=1";
  EXPECT_EQ(in_window(holed, 1, 10, kCamera).of("R4", "callback camera"), Verdict::inconclusive);
}

TEST(Budget, IsInconclusiveWhereNoSwitchTellsAnyMoreWhatWasHidden) {
  EXPECT_EQ(in_window(kMayHaveMoved, 1, 10, kCamera).of("R4", "callback camera"), Verdict::pass);
  const std::string holed = std::string(kMayHaveMoved) + "5 start fusion release=4\n6 end fusion";
  EXPECT_EQ(Verified(holed, kCamera).of("R4", "callback camera"), Verdict::inconclusive);
  EXPECT_EQ(in_window(holed, 1, 10, kCamera).of("R4", "callback camera"), Verdict::inconclusive);
}

// From 10 to 12 and from 16 to 45, when it is switched out for the last time.
constexpr const char* kNeverEnds = R"(
    callback fusion
    callback lidar
    5 switch 0 idle fusion
    10 start fusion release=9
    12 preempt fusion by=lidar
    16 switch 0 lidar fusion state=1
    40 finish fusion
    45 switch 0 fusion idle state=1
    45 switch 1 idle lidar
    46 switch 1 lidar idle)";

TEST(Budget, FailsForAnInstanceThatNeverEnded) {
  const Verified verified(kNeverEnds, spec("wcet: 30"));
  EXPECT_EQ(verified.of("R4", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R4", "callback fusion"),
              AllOf(HasSubstr("10 callback_start seq 0 starts, and never ends"),
                    HasSubstr("45  execution time until here 31 ns, spec.yaml:2 declares at most "
                              "30 ns")));
  EXPECT_NE(Verified(kNeverEnds, spec("wcet: 31"))["R4"], Verdict::fail);
  EXPECT_NE(Verified("process app crash\n" + std::string(kNeverEnds), spec("wcet: 30"))["R4"],
            Verdict::fail)
      << "one cut by a crash is not judged";
}

// Its tid is another thread's from then on.
TEST(Budget, CountsOfAnInstanceThatNeverEndedNothingAfterTheExitOfItsThread) {
  auto text = std::string(kNeverEnds);
  text.insert(text.find("    45 switch 0"), "    44 exit fusion\n");
  text += "\n50 switch 0 idle fusion\n90 switch 0 fusion idle state=1";
  EXPECT_EQ(Verified(text, spec("wcet: 29"))["R4"], Verdict::fail);
  EXPECT_NE(Verified(text, spec("wcet: 30"))["R4"], Verdict::fail);
}

// Where it ran since it was switched in last no event confirms.
TEST(Budget, CountsOfAnInstanceThatNeverEndedWhatTheKernelShowsWithoutHole) {
  auto text = std::string(kNeverEnds);
  const std::string out = "    45 switch 0 fusion idle state=1\n";
  text.erase(text.find(out), out.size());
  EXPECT_NE(Verified(text, spec("wcet: 30"))["R4"], Verdict::fail);
  const auto hole = std::string(kNeverEnds) + "\n30 discard kernel until=31 count=1";
  EXPECT_NE(Verified(hole, spec("wcet: 30"))["R4"], Verdict::fail);
}

TEST(Budget, PassesByDurationWithoutKernelEventsOrIsInconclusive) {
  EXPECT_EQ(Verified(kTwoRuns, spec("wcet: 6"))["R4"], Verdict::pass);
  EXPECT_EQ(Verified(kTwoRuns, spec("wcet: 5"))["R4"], Verdict::inconclusive);
  EXPECT_EQ(Verified(kTwoRuns)["R4"], Verdict::not_applicable);
}

}  // namespace
}  // namespace cie::test
