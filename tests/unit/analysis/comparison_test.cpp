// What two samples allow to say about each other.
#include "compared_callbacks.hpp"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

// 10 events more of 1000 trials each may be chance, 60 more are not.
TEST(Compare, CountsRatesBeyondChance) {
  const Rate before{.events = 20, .trials = 1000};
  EXPECT_EQ(compare(before, Rate{.events = 30, .trials = 1000}, 0), Change::undecided);
  EXPECT_EQ(compare(before, Rate{.events = 80, .trials = 1000}, 0), Change::worse);
  EXPECT_EQ(compare(Rate{.events = 80, .trials = 1000}, before, 0), Change::better);
  EXPECT_EQ(compare(Rate{.events = 0, .trials = 9}, Rate{.events = 0, .trials = 9}, 0),
            Change::within);
  EXPECT_EQ(compare(Rate{.events = 0, .trials = 0}, Rate{.events = 5, .trials = 9}, 0),
            Change::undecided);
}

TEST(Compare, FindsTheCallbackThatBecameSlower) {
  const auto slower = compared(sample(1'000'000, 2'000), sample(2'000'000, 2'000));
  ASSERT_EQ(slower.callbacks.size(), 1U);
  EXPECT_TRUE(slower.callbacks.front().is_regression());
  EXPECT_EQ(slower.callbacks.front().quantities.front().change, Change::worse);
  EXPECT_EQ(slower.outcome(), Outcome::regression);
  EXPECT_EQ(compared(sample(1'000'000, 2'000), sample(1'000'000, 2'000)).outcome(),
            Outcome::no_regression);
}

TEST(Compare, OfARecordingWithItselfIsNoRegression) {
  EXPECT_EQ(compared(sample(1'000'000, 3), sample(1'000'000, 3)).outcome(), Outcome::no_regression);
  EXPECT_EQ(compared(sample(1'000'000, 3), sample(1'000'000, 4)).outcome(), Outcome::undecided);
}

TEST(Compare, DecidesNothingWhereNoTimeIsDecided) {
  EXPECT_EQ(compared(sample(1'000'000, 3), sample(2'000'000, 3)).outcome(), Outcome::undecided);
  auto comparison = compared(sample(1'000'000, 3), sample(2'000'000, 3));
  EXPECT_TRUE(comparison.has_compared());
  EXPECT_FALSE(comparison.may_lack_runs());
  comparison.callbacks.front().quantities.front().change = Change::within;
  EXPECT_EQ(comparison.outcome(), Outcome::no_regression) << "one is enough";
  comparison.callbacks.front().quantities.front().change = Change::undecided;
  comparison.callbacks.front().of(Count::missed_releases).change = Change::better;
  EXPECT_EQ(comparison.outcome(), Outcome::no_regression);
}

TEST(Compare, MissesWhatIsGoneAndNoticesLostIsolation) {
  auto other = sample(0, 10);
  other.logical_id = "/b";
  const auto changes = compared(sample(0, 10), other).callbacks;
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_TRUE(changes[0].is_regression()) << "/a is gone";
  EXPECT_FALSE(changes[1].is_regression()) << "/b is new";
  auto shared = sample(0, 10);
  shared.isolation = Isolation::not_isolated;
  EXPECT_TRUE(change(sample(0, 10), shared).lost_isolation);
  auto by_chance = sample(0, 10);
  by_chance.is_isolation_claimed = false;
  EXPECT_FALSE(change(by_chance, shared).lost_isolation) << "of a pool, whose threads ran one each";
}

// Of a rate that stayed, 0 of n + 0 instances fall on the time after with probability 0.5^n: below 0.001
// from n = 10.
TEST(Compare, MissesWhatNeverRunsAnyMoreBeyondChance) {
  EXPECT_EQ(change(sample(0, 10), sample(0, 0)).absence, Absence::never_runs);
  EXPECT_TRUE(change(sample(0, 10), sample(0, 0)).is_regression());
  EXPECT_EQ(change(sample(0, 9), sample(0, 0)).absence, Absence::none);
  auto open = sample(0, 0);
  open.incomplete = 1;
  EXPECT_EQ(change(sample(0, 10), open).absence, Absence::none) << "it runs";
}

// As of a process that was attached to after its start-up: whether it would run again nobody knows.
TEST(Compare, OfWhatRanBeforeTheRecordItIsUndecidedWhetherItRunsAnyMore) {
  auto attached = sample(0, 0);
  attached.runs_not_seen = 20;
  const auto comparison = compared(sample(0, 20), attached);
  EXPECT_EQ(comparison.callbacks.at(0).absence, Absence::never_runs);
  EXPECT_FALSE(comparison.callbacks.at(0).is_absence_proved);
  EXPECT_FALSE(comparison.callbacks.at(0).is_regression());
  EXPECT_EQ(comparison.outcome(), Outcome::undecided);
}

TEST(Compare, KeepsWhatTheRecorderSaidOfEachOfItsProblems) {
  const auto defect = [](DefectKind kind, const char* advice) {
    return TraceDefect{.kind = kind, .severity = Severity::error, .count = 1, .advice = advice};
  };
  const auto record = ComparedRecord::of(
      {},
      {defect(DefectKind::recorder_problem, "full"), defect(DefectKind::damaged_packets, "cut"),
       defect(DefectKind::recorder_problem, "ended"), defect(DefectKind::damaged_packets, "cut")},
      true);
  EXPECT_EQ(record.losses, (std::vector<RecordLoss>{{DefectKind::recorder_problem, 1, "full"},
                                                    {DefectKind::damaged_packets, 2, ""},
                                                    {DefectKind::recorder_problem, 1, "ended"}}));
}

// A record a ninth as long has 0 of 10 instances with probability 0.9^10.
TEST(Compare, ExpectsFewerRunsOfAShorterRecord) {
  ComparedSide before{.record = {.is_complete = true, .losses = {}, .length = Duration{9'000}},
                      .callbacks = {sample(0, 10)}};
  ComparedSide after{.record = {.is_complete = true, .losses = {}, .length = Duration{1'000}},
                     .callbacks = {sample(0, 0)}};
  EXPECT_EQ(compare(before, after, 0.05).callbacks.at(0).absence, Absence::none);
  EXPECT_EQ(compare(after, before, 0.05).outcome(), Outcome::nothing_compared);
}

TEST(Compare, OfAnIncompleteRecordIsUndecidedWhatIsGone) {
  ComparedSide before{.record = {.is_complete = true, .losses = {}, .length = {}},
                      .callbacks = {sample(0, 10)}};
  ComparedSide after{.record = {}, .callbacks = {sample(0, 0)}};
  for (const auto absence : {Absence::never_runs, Absence::gone}) {
    const auto comparison = compare(before, after, 0.05);
    EXPECT_EQ(comparison.callbacks.at(0).absence, absence);
    EXPECT_FALSE(comparison.callbacks.at(0).is_regression());
    EXPECT_EQ(comparison.outcome(), Outcome::undecided);
    after.callbacks.clear();
  }
}

TEST(Compare, MissesNothingThatNeverRanBefore) {
  const auto gone = [](std::uint64_t not_seen, std::vector<RecordLoss> losses) {
    auto unused = sample(0, 0);
    unused.logical_id = "/b";
    unused.runs_not_seen = not_seen;
    const ComparedSide before{
        .record = {.is_complete = false, .losses = std::move(losses), .length = {}},
        .callbacks = {sample(1'000'000, 1'000), unused}};
    const ComparedSide after{.record = {.is_complete = true, .losses = {}, .length = {}},
                             .callbacks = {sample(1'000'000, 1'000)}};
    return compare(before, after, 0.05);
  };
  const auto unused = gone(0, {});
  EXPECT_EQ(unused.callbacks.at(1).absence, Absence::gone_unused);
  EXPECT_FALSE(unused.callbacks.at(1).is_regression());
  EXPECT_EQ(unused.outcome(), Outcome::no_regression);
  EXPECT_EQ(gone(1, {}).outcome(), Outcome::regression) << "it ran before the recording";
  EXPECT_EQ(gone(0, {{}}).outcome(), Outcome::undecided) << "its runs may be lost";
}

TEST(Compare, MissesAProcessAndNotARestart) {
  const auto in_processes = [](std::uint64_t all, std::optional<std::uint64_t> at_once) {
    auto result = sample(0, 100);
    result.processes = all;
    result.processes_at_once = at_once;
    return result;
  };
  EXPECT_EQ(change(in_processes(2, 2), in_processes(1, 1)).absence, Absence::gone_from_process);
  EXPECT_TRUE(change(in_processes(2, 2), in_processes(1, 1)).is_regression());
  EXPECT_EQ(change(in_processes(2, 1), in_processes(1, 1)).absence, Absence::none) << "restarted";
  EXPECT_EQ(change(in_processes(2, 2), in_processes(2, 1)).absence, Absence::gone_from_process)
      << "one, started twice";
  const auto of_reports = change(in_processes(2, std::nullopt), in_processes(1, std::nullopt));
  EXPECT_EQ(of_reports.absence, Absence::gone_from_process);
  EXPECT_FALSE(of_reports.is_regression()) << "a report does not say whether they ran at once";
  EXPECT_FALSE(change(in_processes(2, std::nullopt), in_processes(1, 1)).is_regression())
      << "they may have been one, started twice";
}

// Two processes of a report may have run at once, or one after the other.
TEST(Compare, LeavesOpenWhetherAReportsProcessesAreFewer) {
  const auto of_report = [](std::uint64_t processes, std::int64_t first) {
    auto result = sample(first, 100);
    result.processes = processes;
    result.processes_at_once.reset();
    result.are_lives_told = false;
    return result;
  };
  const auto outcome = [](const CallbackSample& before, const CallbackSample& after) {
    return compared(before, after).outcome();
  };
  EXPECT_EQ(change(of_report(2, 0), of_report(2, 1)).absence, Absence::gone_from_process);
  EXPECT_EQ(outcome(of_report(2, 0), of_report(2, 1)), Outcome::undecided);
  EXPECT_EQ(change(of_report(2, 0), of_report(2, 0)).absence, Absence::none) << "the same report";
  EXPECT_EQ(change(of_report(1, 0), of_report(2, 1)).absence, Absence::none);
}

// One delay of 20 periods misses 20 releases and is one event.
TEST(Compare, CountsADelayOnceHoweverManyReleasesItMissed) {
  auto before = sample(0, 1'000);
  before.missed_releases = 0;
  before.missing_instances = 0;
  auto after = before;
  after.missed_releases = 20;
  after.missing_instances = 1;
  EXPECT_EQ(change(before, after).of(Count::missed_releases).change, Change::undecided);
  EXPECT_EQ(change(before, after).of(Count::missed_releases).after, 20U);
  after.missing_instances = 20;
  EXPECT_EQ(change(before, after).of(Count::missed_releases).change, Change::worse);
  after.missing_instances.reset();
  EXPECT_EQ(change(before, after).of(Count::missed_releases).change, Change::worse)
      << "a report tells releases alone";
}

CallbackReport timer(ReleaseSource source) {
  CallbackReport report;
  report.kind = CallbackKind::timer;
  report.release_source = source;
  report.response_time = Summary{};
  return report;
}

// What ROS 2's events tell of a timer is another expiry than what its executor does.
TEST(Compare, NoticesOtherReleasesOfTimersThatSkippedPeriods) {
  auto own = sample(0, 1'000);
  own.missed_releases = 0;
  own.timer_releases = TimerReleases::of(timer(ReleaseSource::exact));
  auto of_ros2 = own;
  of_ros2.timer_releases = TimerReleases::of(timer(ReleaseSource::timer_grid));
  EXPECT_FALSE(change(own, of_ros2).has_other_releases) << "no period was skipped";
  own.missed_releases = 1;
  EXPECT_TRUE(change(own, of_ros2).has_other_releases);
  EXPECT_TRUE(change(of_ros2, own).has_other_releases);
  EXPECT_FALSE(change(own, own).has_other_releases);
  auto unknown = of_ros2;
  unknown.timer_releases = TimerReleases::of(timer(ReleaseSource::start));
  EXPECT_FALSE(change(own, unknown).has_other_releases) << "it has no releases";
}

// Some releases are not known, and the others follow from the grid.
TEST(Compare, KnowsReleasesOfTheGridByTheirError) {
  auto some = timer(ReleaseSource::mixed);
  some.release_error = Duration{10'000};
  EXPECT_TRUE(TimerReleases::of(some).are_of_grid);
  some.kind = CallbackKind::subscription;
  EXPECT_FALSE(TimerReleases::of(some).are_known());
}

TEST(Compare, NoticesWhatNeverEndsAndExceptions) {
  auto hanging = sample(0, 900);
  hanging.incomplete = 1;
  hanging.never_ends = true;
  EXPECT_TRUE(change(sample(0, 1'000), hanging).never_ends);
  EXPECT_FALSE(change(hanging, hanging).never_ends) << "as before";
  auto cut = hanging;
  cut.never_ends = false;
  EXPECT_TRUE(change(cut, hanging).never_ends) << "an edge of the recording is no hang";
  EXPECT_FALSE(change(sample(0, 1'000), cut).never_ends);
  cut.never_ends.reset();
  EXPECT_FALSE(change(cut, hanging).never_ends) << "it may have hung before";
  EXPECT_FALSE(change(sample(0, 1'000), cut).never_ends) << "it may go on";
  auto ended = sample(0, 1'000);
  ended.exceptions = 0;
  auto thrown = ended;
  thrown.exceptions = 60;
  EXPECT_EQ(change(ended, thrown).of(Count::exceptions).change, Change::worse);
  EXPECT_EQ(change(thrown, ended).of(Count::exceptions).change, Change::better);
  EXPECT_FALSE(change(ended, ended).is_regression());
}

// As Q1 does, by their share of all samples.
TEST(Compare, NoticesMoreLostAndOverwrittenSamples) {
  auto whole = sample(0, 1'000);
  EXPECT_EQ(change(whole, whole).of(Count::lost_samples).change, Change::undecided) << "not told";
  whole.lost_samples = 0;
  whole.overwritten_samples = 2;
  auto losing = whole;
  losing.lost_samples = 60;
  EXPECT_EQ(change(whole, losing).of(Count::lost_samples).change, Change::worse);
  EXPECT_TRUE(change(whole, losing).is_regression());
  EXPECT_EQ(change(losing, whole).of(Count::lost_samples).change, Change::better);
  auto overwriting = whole;
  overwriting.overwritten_samples = 90;
  EXPECT_EQ(change(whole, overwriting).of(Count::overwritten_samples).change, Change::worse);
  EXPECT_TRUE(change(whole, overwriting).is_regression());
  EXPECT_FALSE(change(overwriting, overwriting).is_regression());
}

TEST(Compare, HasASampleForEachIdInTheOrderInWhichTheyCame) {
  SamplesById samples;
  for (const auto* id : {"b", "a", "b", "c"}) {
    auto one = sample(0, 100);
    one.logical_id = id;
    samples.add(std::move(one));
  }
  const auto all = std::move(samples).take();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].logical_id, "b");
  EXPECT_EQ(all[0].instances, 2 * sample(0, 100).instances);
  EXPECT_EQ(all[1].logical_id, "a");
  EXPECT_EQ(all[2].logical_id, "c");
}

// Of one of two processes a count is known: 60 of 200 instances at least, and nobody knows how many more.
TEST(Compare, KnowsNoSumOfWhichOnePartIsUnknown) {
  using Count = std::optional<std::uint64_t> CallbackSample::*;
  for (const Count count : {&CallbackSample::exceptions, &CallbackSample::missed_releases,
                            &CallbackSample::missing_instances, &CallbackSample::lost_samples,
                            &CallbackSample::overwritten_samples}) {
    const auto sum = [&](std::optional<std::uint64_t> first, std::optional<std::uint64_t> second) {
      SamplesById samples;
      for (const auto& part : {first, second}) {
        auto of_process = sample(0, 100);
        of_process.*count = part;
        samples.add(std::move(of_process));
      }
      return std::move(samples).take().at(0).*count;
    };
    EXPECT_EQ(sum(0, 60), 60U);
    EXPECT_EQ(sum(60, std::nullopt), std::nullopt);
    EXPECT_EQ(sum(std::nullopt, 60), std::nullopt);
  }
}

// Half as many runs as before is 500 and not less; 300 are, beyond chance.
TEST(Compare, NoticesFarFewerRuns) {
  EXPECT_TRUE(change(sample(0, 1'000), sample(0, 300)).runs_less);
  EXPECT_FALSE(change(sample(0, 1'000), sample(0, 500)).runs_less);
  EXPECT_FALSE(change(sample(0, 1'000), sample(0, 300)).is_regression());
}

TEST(Compare, OfRecordsThatLackRunsIsUndecided) {
  TraceSummary trace;
  trace.complete = false;
  const auto record = ComparedRecord::of(
      trace,
      {{.kind = DefectKind::seq_gaps, .severity = Severity::loss, .count = 5, .advice = {}},
       {.kind = DefectKind::sched_switch_gaps,
        .severity = Severity::loss,
        .count = 7,
        .advice = {}},
       {.kind = DefectKind::open_instances, .count = 9, .advice = {}}},
      true);
  EXPECT_EQ(record.losses, (std::vector{RecordLoss{DefectKind::seq_gaps, 5}}));
  const ComparedSide whole{.record = {.is_complete = true, .losses = {}, .length = {}},
                           .callbacks = {sample(1'000'000, 2'000)}};
  const ComparedSide lossy{.record = record, .callbacks = {sample(1'000'000, 2'000)}};
  EXPECT_EQ(compare(whole, lossy, 0.05).outcome(), Outcome::undecided);
  EXPECT_EQ(compare(lossy, whole, 0.05).outcome(), Outcome::undecided);
  EXPECT_EQ(compare(whole, whole, 0.05).outcome(), Outcome::no_regression);
}

TEST(Compare, TakesARecordWithoutCallbacksForNoProof) {
  TraceSummary trace;
  trace.complete = true;
  EXPECT_TRUE(ComparedRecord::of(trace, {}, true).is_complete);
  EXPECT_FALSE(ComparedRecord::of(trace, {}, false).is_complete);
}

TEST(Compare, DoesNotAccuseWhatNeverRanOfSharing) {
  auto idle = sample(0, 0);
  for (const auto isolation : {std::optional(Isolation::never_ran), std::optional<Isolation>()}) {
    idle.isolation = isolation;
    EXPECT_FALSE(change(sample(0, 10), idle).lost_isolation);
  }
}

}  // namespace
}  // namespace cie::analysis
