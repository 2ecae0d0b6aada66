// What the report's first screen holds against callbacks, and what it does not.
#include "report_screens.hpp"
#include "sample_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// One callback on two pool threads, which run nothing else.
TEST(ReportAccusations, WhatRanOnSeveralThreadsNeedNotShareThem) {
  auto report = test::sample_report();
  report.processes[0].executor = "multi_threaded";
  report.threads[1].callbacks = {report.callbacks[1].logical_id};
  report.threads[1].ran = {analysis::CallbackIndex{1}};
  EXPECT_THAT(screen_of(report, test::sample_verdicts(), {}, {}),
              StartsWith("run 1: callbacks on several threads: 1 of 2\n"));
  EXPECT_THAT(screen_of(report, test::sample_verdicts(), {}, {.is_isolation_expected = true}),
              StartsWith("FAIL  run 1: 1 of 2 callbacks ran on several threads\n"));
}

// Of two executors in a process the isolated one claims something, of its own threads.
TEST(ReportAccusations, AreOfWhatAnIsolatedExecutorClaims) {
  auto report = shared_report();
  report.processes[0].executor = "isolated+single_threaded";
  report.threads[1].role = ThreadRole::dispatcher;
  EXPECT_THAT(screen_of(report, test::sample_verdicts()),
              StartsWith("run 1: callbacks share threads: 1 of 2\n"
                         "  130.0 ms on robot: 1 process, isolated+single_threaded executor; "));
  report.threads[1].role = ThreadRole::callback;
  EXPECT_THAT(screen_of(report, test::sample_verdicts()),
              StartsWith("FAIL  run 1: 1 of 2 callbacks share threads\n"));
}

// Another process, which kept what it claims, claims nothing of this one.
TEST(ReportAccusations, AreOfNoProcessThatClaimsNothing) {
  auto report = shared_report();
  report.processes.push_back(report.processes[0]);
  report.processes[1].pid += 1;
  report.processes[0].executor = "multi_threaded";
  report.threads[1].role = ThreadRole::pool;
  EXPECT_THAT(screen_of(report, test::sample_verdicts()),
              StartsWith("run 1: callbacks share threads: 1 of 2\n"));
  EXPECT_THAT(screen_of(report, test::sample_verdicts(), {}, {.is_isolation_expected = true}),
              StartsWith("FAIL  run 1: 1 of 2 callbacks share threads\n"));
  report.processes[0].executor = "isolated";
  EXPECT_THAT(screen_of(report, test::sample_verdicts()),
              StartsWith("FAIL  run 1: 1 of 2 callbacks share threads\n"));
}

TEST(ReportAccusations, MissedReleasesAreBadWhereTheyAreMoreThanAllowed) {
  const auto cell = [](analysis::Verdict verdict) {
    auto verdicts = test::sample_verdicts();
    analysis::RuleVerdict rule{
        .id = "R2", .name = "no-missed-release", .verdict = verdict, .subjects = {}};
    rule.subjects.push_back(
        {.about = analysis::Subject::of(analysis::SubjectKind::callback, analysis::CallbackIndex{0},
                                        analysis::ProcessIndex{0}),
         .subject = "callback",
         .verdict = verdict,
         .checked = 7,
         .evidence = {}});
    verdicts.rules.push_back(rule);
    return screen_of(test::sample_report(), verdicts, {.colour = true, .columns = 120}, {});
  };
  EXPECT_THAT(cell(analysis::Verdict::fail), HasSubstr("\x1b[1;31m     3\x1b[0m"));
  EXPECT_THAT(cell(analysis::Verdict::pass), Not(HasSubstr("\x1b[1;31m     3\x1b[0m")));
}

}  // namespace
}  // namespace cie::viewer_export
