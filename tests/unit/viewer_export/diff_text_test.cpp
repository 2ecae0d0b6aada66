#include "diff_texts.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

using analysis::Absence;
using analysis::Comparison;
using analysis::Count;

TEST(DiffText, SaysFirstWhatBecameWorseAndBetterAndHowIsolationChanged) {
  auto worse = kWorse;
  worse.lost_isolation = true;
  EXPECT_EQ(
      diff_text_of({kBetter, kSame, worse}),
      "Worse: 1 of 3 callbacks (1 slower, 1 not isolated any more); better: 1, beyond a tolerance of 5 %\n"
      "  isolation  3 of 3 callbacks had a thread of their own before, 2 of 3 after\n"
      "\n"
      "  no longer has a thread of its own: plan timer 20 ms\n"
      "\n"
      "  callback          quantity            before    after   change\n"
      "  plan timer 20 ms  response time p99  1.000ms  3.000ms   +200 %  worse\n"
      "  lidar <- /points  duration p50       2.000us  1.000us  -50.0 %  better\n"
      "  look: cie view new\n");
}

TEST(DiffText, NamesTheHostsWhoseRunsCountTogether) {
  auto comparison = comparison_of({kSame});
  comparison.before.hosts = comparison.after.hosts = {"robot"};
  EXPECT_THAT(diff_text_of(comparison), Not(HasSubstr("robot")));
  comparison.before.hosts = comparison.after.hosts = {"edge", "robot"};
  EXPECT_THAT(
      diff_text_of(comparison),
      HasSubstr("  hosts      edge, robot: runs of one id on any of them count together\n"));
  comparison.after.hosts = {"robot"};
  EXPECT_THAT(diff_text_of(comparison), HasSubstr("edge, robot before, robot after: runs of one"));
}

// Of everything that a comparison can say, many.
Comparison much(bool has_deadlines) {
  std::vector<CallbackChange> changes;
  for (int i = 0; i < 40; ++i) {
    auto change = change_of(fmt::format("/a/n{}@Timer(20000000)", i), "response_time", 990,
                            1'000'000, 2'000'000 + i);
    change.absence = std::array{Absence::gone, Absence::gone_from_process, Absence::never_runs,
                                Absence::none}[static_cast<std::size_t>(i % 4)];
    change.is_absence_proved = i < 20;
    change.lost_isolation = change.never_ends = change.runs_less = true;
    for (const auto count : {Count::exceptions, Count::lost_samples, Count::overwritten_samples})
      change.of(count) = {.before = 0, .after = 9, .change = Change::worse};
    const analysis::Lateness late{
        .deadline = {2'000}, .late = 5, .instances = 10, .max = 4'000'000};
    if (has_deadlines) {
      change.lateness_before = change.lateness_after = late;
      change.of(Count::late) = {.before = 5, .after = 5};
    }
    changes.push_back(change);
  }
  changes.push_back(kBetter);
  auto comparison = comparison_of(changes);
  comparison.before.losses = comparison.after.losses = {{analysis::DefectKind::damaged_packets, 2},
                                                        {analysis::DefectKind::seq_gaps, 325}};
  return comparison;
}

// Of one callback ROS 2's events leave open whether something else ran on its thread.
TEST(DiffText, TellsBetweenWhatIsolationLiesWhereItIsNotKnown) {
  std::ostringstream out;
  write_diff_text(out, {},
                  {.before = "old",
                   .after = "new",
                   .tolerance = 0.05,
                   .isolation_before = {.own_thread = 1, .ran = 3, .unknown = 1},
                   .isolation_after = {.own_thread = 0, .ran = 3},
                   .is_all = false,
                   .arguments = "old new"},
                  {});
  EXPECT_THAT(out.str(),
              HasSubstr("1 to 2 of 3 callbacks had a thread of their own before, 0 of 3 after"));
  std::ostringstream of_nothing;
  write_diff_text(of_nothing, {},
                  {.before = "old",
                   .after = "new",
                   .tolerance = 0.05,
                   .isolation_before = {.own_thread = 1, .ran = 3},
                   .isolation_after = {},
                   .is_all = false,
                   .arguments = "old new"},
                  {});
  EXPECT_THAT(of_nothing.str(), Not(HasSubstr("isolation")));
}

TEST(DiffText, IsOneScreenUnlessAllIsWanted) {
  for (const bool has_deadlines : {false, true}) {
    const auto comparison = much(has_deadlines);
    const TextStyle terminal{.columns = 80};
    const auto text = diff_text_of(comparison, terminal);
    EXPECT_LE(std::ranges::count(text, '\n'), 23) << text;
    const auto shorter = diff_text_of(comparison, {.columns = 80, .lines = 21});
    EXPECT_LE(std::ranges::count(shorter, '\n'), 21) << shorter;
    EXPECT_THAT(text, HasSubstr("  is gone: n0 timer 20 ms, n4 timer 20 ms, n8 timer 20 ms, "));
    EXPECT_THAT(text, HasSubstr("\n  ... 5 more kinds of change\n"));
    EXPECT_THAT(text,
                testing::ContainsRegex(
                    "\n  [0-9]+ more changes: cie diff old new --all    look: cie view new\n$"));
    const auto all = diff_text_of(comparison, terminal, true);
    for (int i = 0; i < 40; ++i)
      EXPECT_THAT(all, HasSubstr(fmt::format("\n  n{} timer 20 ms  ", i)));
    EXPECT_THAT(all, Not(HasSubstr("...")));
  }
}

TEST(DiffText, HasNoStatisticsOfNothing) {
  auto added = kSame;
  added.is_before = false;
  added.quantities.clear();
  EXPECT_THAT(diff_text_of({added}),
              testing::AllOf(Not(HasSubstr("quantile")), Not(HasSubstr("certain"))));
}

TEST(DiffText, OfNoRegressionSaysWhatIsBetter) {
  EXPECT_THAT(diff_text_of({kBetter, kSame}),
              StartsWith("No regression; better: 1 of 2 callbacks, beyond a tolerance of 5 %\n"));
  EXPECT_THAT(diff_text_of({kSame}),
              StartsWith("No regression: all runs and times are the same\n"));
}

TEST(DiffText, NamesWhatIsGoneAndNew) {
  auto gone = kSame;
  gone.is_after = false;
  gone.absence = Absence::gone;
  gone.is_absence_proved = true;
  auto added = kBetter;
  added.is_before = false;
  const auto text = diff_text_of({gone, added}, {.ids = true});
  EXPECT_THAT(text, HasSubstr("  is gone: /a/map@Timer(1000)\n"));
  EXPECT_THAT(text, HasSubstr("  is new: /a/lidar@Subscription(/points)\n"));
}

TEST(DiffText, NamesWhatRunsOtherwise) {
  auto silent = kSame;
  silent.absence = Absence::never_runs;
  silent.is_absence_proved = true;
  auto fewer = kWorse;
  fewer.absence = Absence::gone_from_process;
  fewer.is_absence_proved = true;
  fewer.processes_before = 2;
  fewer.processes_after = 1;
  auto hanging = kBetter;
  hanging.never_ends = true;
  hanging.of(Count::exceptions) = {.before = 0, .after = 90, .change = Change::worse};
  hanging.runs_less = true;
  hanging.instances_after = 3;
  const auto text = diff_text_of({silent, fewer, hanging});
  EXPECT_THAT(
      text, StartsWith("Worse: 3 of 3 callbacks (1 slower, 1 gone from processes, 1 never running "
                       "any more, 1 with an\n  instance that never ends, 1 with more exceptions), "
                       "beyond a tolerance of 5 %\n"));
  EXPECT_THAT(text,
              HasSubstr("\n  is gone from processes: plan timer 20 ms (2 -> 1 processes)\n"
                        "  never runs any more: map timer 1 us (100 instances before)\n"
                        "  has an instance that never ends: lidar <- /points\n"
                        "  runs less than half as often: lidar <- /points (100 -> 3 instances)\n"));
  EXPECT_THAT(text, testing::ContainsRegex("lidar <- /points  exceptions  +0 +90 +- +worse\n"));
}

TEST(DiffText, SaysApartWhatIsGoneAndNeverRan) {
  auto unused = kSame;
  unused.logical_id = "/plan@Service(/set)";
  unused.is_after = false;
  unused.absence = Absence::gone_unused;
  unused.is_absence_proved = true;
  unused.quantities.clear();
  const auto text = diff_text_of({unused, kWorse});
  EXPECT_THAT(text, StartsWith("Worse: 1 of 2 callbacks (1 slower)"));
  EXPECT_THAT(text, HasSubstr("\n  is gone, without a run before: /plan <= /set"));
}

// The tolerance is one of times.
TEST(DiffText, SaysInWhatCallbacksBecameWorse) {
  auto gone = kSame;
  gone.is_after = false;
  gone.absence = Absence::gone;
  gone.is_absence_proved = true;
  gone.quantities.clear();
  EXPECT_THAT(diff_text_of({gone, kSame}), StartsWith("Worse: 1 of 2 callbacks (1 gone)\n"));
  EXPECT_THAT(
      diff_text_of({gone, kWorse}),
      StartsWith("Worse: 2 of 2 callbacks (1 slower, 1 gone), beyond a tolerance of 5 %\n"));
  auto shared = kSame;
  shared.lost_isolation = true;
  EXPECT_THAT(diff_text_of({shared, shared}),
              StartsWith("Worse: 2 of 2 callbacks (2 not isolated any more)\n"));
  auto losing = kSame;
  for (const auto count : {Count::lost_samples, Count::missed_releases})
    losing.of(count) = {.before = 0, .after = 9, .change = Change::worse};
  EXPECT_THAT(diff_text_of({losing}),
              StartsWith("Worse: 1 of 1 callback (1 with more missed releases, 1 with more lost "
                         "samples)\n"));
}

// Counts that are worse come before times, also of another callback than those with a deadline.
TEST(DiffText, TellsOfCountsThatAreWorseFirst) {
  auto change = kSame;
  change.of(Count::missed_releases) = {.before = 0, .after = 40, .change = Change::worse};
  change.of(Count::lost_samples) = {.before = 0, .after = 60, .change = Change::worse};
  change.of(Count::overwritten_samples) = {.before = 0, .after = 90, .change = Change::worse};
  constexpr auto kTold =
      "  map timer 1 us    overwritten samples        0       90       -  worse\n"
      "                    lost samples               0       60       -  worse\n"
      "                    missed releases            0       40       -  worse\n";
  EXPECT_THAT(diff_text_of({kWorse, change}),
              testing::AllOf(HasSubstr(std::string("change\n") + kTold + "  plan timer 20 ms")));
  const auto text = diff_text_of({with_deadline(2'000'000, 0, 0), change});
  EXPECT_THAT(text, testing::ContainsRegex("map timer 1 us +overwritten samples +0 +90 .*worse\n"));
}

TEST(DiffText, OfWhatARecordDoesNotProveSaysThatItMayBe) {
  auto gone = kSame;
  gone.is_after = false;
  gone.absence = Absence::gone;
  auto comparison = comparison_of({gone, kBetter});
  comparison.after.is_complete = false;
  const auto text = diff_text_of(comparison);
  EXPECT_THAT(text, StartsWith("Undecided: no regression in what was recorded; better: 1 of 2 "
                               "callbacks, beyond a tolerance of 5 %\n"
                               "  record     not known to be complete: after\n"
                               "  isolation "));
  EXPECT_THAT(text, HasSubstr("\n  may be gone: map timer 1 us\n"));

  gone.instances_after = 0;
  auto unrelated = comparison_of({gone});
  unrelated.after.is_complete = false;
  EXPECT_THAT(diff_text_of(unrelated),
              StartsWith("Undecided: no callback ran in both recordings\n  record "));
}

TEST(DiffText, SaysWhatTheRecordsLack) {
  using analysis::DefectKind;
  auto comparison = comparison_of({kSame});
  comparison.before.is_complete = false;
  comparison.after.is_complete = false;
  EXPECT_THAT(diff_text_of(comparison),
              StartsWith("No regression in what was recorded, beyond a tolerance of 5 %\n"
                         "  record     not known to be complete: before and after\n"));
  comparison.after.losses = {{DefectKind::damaged_packets, 2}, {DefectKind::seq_gaps, 325}};
  EXPECT_THAT(
      diff_text_of(comparison),
      StartsWith("Undecided: no regression in what was recorded, beyond a tolerance of 5 %\n"
                 "  record     after lacks instances: damaged-packets x 2, seq-gaps x 325\n"
                 "  record     not known to be complete: before\n"));
}

TEST(DiffText, SaysWhichProblemsTheRecorderHad) {
  using analysis::DefectKind;
  auto comparison = comparison_of({kSame});
  comparison.after.losses = {{DefectKind::recorder_problem, 1, "the disk was full"},
                             {DefectKind::recorder_problem, 1, "the daemon ended"}};
  EXPECT_THAT(diff_text_of(comparison),
              HasSubstr("after lacks instances: recorder-problem (the disk was full), "
                        "recorder-problem (the"));
}

TEST(DiffText, SaysOnceWhereReleasesAreOtherExpiries) {
  EXPECT_THAT(diff_text_of({kSame, kWorse}), Not(HasSubstr("releases")));
  auto changes = std::vector{kSame, kWorse};
  for (auto& change : changes)
    change.has_other_releases = true;
  constexpr auto kTold =
      "\n  releases   2 timers skipped periods: ROS 2's events tell the oldest expiry that waited, the "
      "other\n             recording the latest due. Such response times do not compare\n";
  EXPECT_THAT(diff_text_of(changes), HasSubstr(kTold));
  EXPECT_THAT(diff_text_of(comparison_of(changes), {}, true), HasSubstr(kTold));
}

TEST(DiffText, SaysThatThereIsNothingToCompare) {
  auto added = kSame;
  added.is_before = false;
  added.instances_before = 0;
  EXPECT_THAT(diff_text_of({added}),
              StartsWith("Nothing to compare: no callback ran before and after\n"));
  EXPECT_THAT(diff_text_of(std::vector<CallbackChange>{}),
              StartsWith("Nothing to compare: no callback ran before and after\n"));
}

TEST(DiffText, SaysFirstThatNoTimeIsDecided) {
  auto change = with_deadline(2'000'000, 3, 0);
  change.quantities.front().change = Change::undecided;
  EXPECT_THAT(
      diff_text_of({change}),
      StartsWith("Times undecided: of 1 quantile none is certain; no other regression\n"
                 "Late: 3 of 100 instances before, 0 of 100 after; 1 callback has a deadline\n"));
  change.quantities.clear();
  EXPECT_THAT(
      diff_text_of({change}),
      StartsWith("Times undecided: none was measured on both sides; no other regression\n"));
  change.of(Count::missed_releases).change = Change::better;
  EXPECT_THAT(diff_text_of({change}),
              testing::ContainsRegex("^No regression; better[^\n]*\nLate: "));
}

TEST(DiffText, TellsUndecidedCountsAndWhatIsMeasuredOnOneSide) {
  auto change = kSame;
  change.of(Count::missed_releases) = {.before = 0, .after = 8};
  change.quantities.push_back(change.quantities.front());
  change.quantities.back().after.reset();
  change.quantities.back().change = Change::undecided;
  const auto text = diff_text_of({change});
  EXPECT_THAT(text, testing::ContainsRegex("map timer 1 us +missed releases +0 +8 .*undecided\n"));
  EXPECT_THAT(text, HasSubstr("\n1 of 2 quantiles undecided: measured on one side (1); 1 "
                              "count may be chance.\n"));
}

// A third of the releases is known.
TEST(DiffText, MarksAQuantileOfWhichOnlyABoundIsKnown) {
  auto worse = change_of("/a/map@Timer(1000)", "response_time", 500, 1'000, 4'000);
  worse.quantities[0].after->estimate.is_bound = true;
  auto open = change_of("/a/plan@Timer(1000)", "response_time", 500, 1'000, 4'000);
  open.quantities[0].before->estimate.is_bound = true;
  open.quantities[0].change = Change::undecided;
  const auto text = diff_text_of({worse, open});
  EXPECT_THAT(text, HasSubstr("1.000us  >4.000us  >+300 %  worse\n"));
  EXPECT_THAT(text, HasSubstr("\n1 of 2 quantiles undecided: releases not known (1).\n"));
  std::swap(worse.quantities[0].before, worse.quantities[0].after);
  worse.quantities[0].change = Change::better;
  EXPECT_THAT(diff_text_of({worse}), HasSubstr("p50  >4.000us  1.000us       -  better\n"));
}

// Intervals of one bucket, 8192 to 8319 and 8320 to 8447.
TEST(DiffText, SaysWhatIsTooCloseToTell) {
  auto change = kSame;
  auto& quantity = change.quantities.front();
  quantity.before = {.lower = 8'192, .estimate = {.ns = 8'256}, .upper = 8'319};
  quantity.after = {.lower = 8'320, .estimate = {.ns = 8'384}, .upper = 8'447};
  quantity.change = Change::undecided;
  EXPECT_THAT(diff_text_of({change}),
              HasSubstr("1 of 1 quantile undecided: values known within 1.6 % (1).\n"));
}

TEST(DiffText, TellsOfLateInstancesFirstWhereThereAreSome) {
  EXPECT_EQ(diff_text_of({kSame, with_deadline(2'000'000, 3, 0), with_deadline(500'000, 7, 1)}),
            "No regression; better: 2 of 3 callbacks, beyond a tolerance of 5 %\n"
            "Late: 10 of 200 instances before, 1 of 200 after; 2 callbacks have a deadline\n"
            "  isolation  3 of 3 callbacks had a thread of their own before, 2 of 3 after\n"
            "\n"
            "  callback          quantity             before    after   change\n"
            "  n7_1 timer 20 ms  late beyond 500 us        7        1        -  undecided\n"
            "                    response time max   4.000ms  1.500ms  -62.5 %  -\n"
            "  n3_0 timer 20 ms  late beyond 2 ms          3        0        -  undecided\n"
            "                    response time max   4.000ms  1.500ms  -62.5 %  -\n"
            "                    response time p99   3.000ms  1.000ms  -66.7 %  better\n"
            "  n7_1 timer 20 ms  response time p99   3.000ms  1.000ms  -66.7 %  better\n"
            "2 counts may be chance.\n");
}

TEST(DiffText, BreaksTheLineOfLateRunsWhereItIsTooLong) {
  EXPECT_THAT(diff_text_of({with_deadline(2'000'000, 3, 0)}, {.columns = 60}),
              HasSubstr("\nLate: 3 of 100 instances before, 0 of 100 after; 1 callback\n"
                        "  has a deadline\n"));
}

TEST(DiffText, TellsWhatIsLateMoreOften) {
  auto change = with_deadline(2'000'000, 0, 9);
  change.of(Count::late).change = Change::worse;
  change.quantities.clear();
  const auto text = diff_text_of({change});
  EXPECT_THAT(text, HasSubstr("Worse: 1 of 1 callback (1 late more often)\n"));
  EXPECT_THAT(text, testing::ContainsRegex("n0_9 timer 20 ms  late beyond 2 ms +0 +9 +- +worse\n"));
  EXPECT_THAT(text, Not(HasSubstr("chance")));
}

TEST(DiffText, MarksALongestRunOfWhichOnlyABoundIsKnown) {
  auto change = with_deadline(2'000'000, 7, 1);
  change.lateness_after->is_max_bound = true;  // 1.5 ms at least
  EXPECT_THAT(diff_text_of({change}), HasSubstr("4.000ms  >1.500ms  >-62.5 %"));
}

TEST(DiffText, SaysBeforeLateRunsThatRecordsDoNotDecide) {
  auto comparison = comparison_of({with_deadline(2'000'000, 3, 0)});
  comparison.after.losses = {{analysis::DefectKind::seq_gaps, 5}};
  EXPECT_THAT(diff_text_of(comparison),
              StartsWith("Undecided: no regression in what was recorded"));
}

TEST(DiffText, RunsAreLateAgainstOneDeadlineOnly) {
  auto change = kSame;
  change.lateness_before =
      analysis::Lateness{.deadline = {1'000}, .late = 5, .instances = 10, .max = 1'500};
  change.lateness_after =
      analysis::Lateness{.deadline = {2'000}, .late = 1, .instances = 10, .max = 2'500};
  const auto text = diff_text_of({change});
  EXPECT_THAT(text, Not(HasSubstr("Late:")));
  EXPECT_THAT(
      text,
      HasSubstr("\n  deadlines  1 callback has another deadline than before: not compared\n"));
  change.lateness_after.reset();
  EXPECT_THAT(diff_text_of({change, kWorse}),
              HasSubstr("1 callback has another deadline than before"));
}

TEST(DiffText, CountsThoseThatRanAndHadAThreadOfTheirOwn) {
  using analysis::Isolation;
  std::vector<analysis::CallbackSample> samples(4);
  samples[0].isolation = Isolation::isolated;
  samples[1].isolation = Isolation::not_isolated;
  samples[2].isolation = Isolation::never_ran;
  samples[3].isolation.reset();
  EXPECT_EQ(isolation_count(samples), (IsolationCount{.own_thread = 1, .ran = 3, .unknown = 1}));
}

}  // namespace
}  // namespace cie::viewer_export
