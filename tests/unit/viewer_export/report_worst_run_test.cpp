// What the report's first screen says of the run that took longest.
#include "report_screens.hpp"
#include "sample_report.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(ReportScreen, SaysWhereTheTimeOfTheWorstRunWent) {
  auto blocked = usual_context();
  auto& worst = blocked.verify.worst_runs[0];  // of 2.5 ms
  worst.preempted.reset();
  worst.start_latency = analysis::Duration{200'000};
  worst.blocked = analysis::Duration{125'000};
  worst.wake_delay = analysis::Duration{50'000};
  worst.execution = analysis::Duration{2'125'000};
  EXPECT_THAT(
      screen_of(shared_report(), {}, {.columns = 200}, blocked),
      HasSubstr("instance 3 at +1.500 ms took 2.500 ms: 2.125 ms executing, 200.0 us waiting to "
                "start, 125.0 us blocked\n"));
}

TEST(ReportScreen, WaitingForACpuIsNotTheCallbacksOwnWork) {
  auto woken = usual_context();
  auto& worst = woken.verify.worst_runs[0];  // of 2.5 ms, a tenth of it executing
  worst.preempted = analysis::Duration{};
  worst.start_latency = analysis::Duration{100'000};
  worst.wake_delay = analysis::Duration{2'150'000};
  worst.execution = analysis::Duration{250'000};
  EXPECT_THAT(
      screen_of(shared_report(), {}, {.columns = 200}, woken),
      HasSubstr("instance 3 at +1.500 ms took 2.500 ms: 2.150 ms waiting for a CPU after it was "
                "woken, 250.0 us executing\n"));
}

TEST(ReportScreen, WithoutTheKernelsEventsNobodyKnowsWhatTheRunDid) {
  auto alone = usual_context();
  auto& worst = alone.verify.worst_runs[0];  // of 2.5 ms
  worst.preempted.reset();
  worst.start_latency = analysis::Duration{200'000};
  EXPECT_THAT(
      screen_of(shared_report(), {}, {.columns = 200}, alone),
      HasSubstr("instance 3 at +1.500 ms took 2.500 ms: 2.300 ms from start to end, 200.0 us "
                "waiting to start\n"));
}

TEST(ReportScreen, NamesNoWorstRunOfAReleaseThatNothingProved) {
  EXPECT_THAT(screen_of(shared_report(), {}), HasSubstr("worst: "));
  auto unproven = usual_context();
  unproven.verify.worst_runs[0].response_time = {2'500'001};  // the report has no time as long
  EXPECT_THAT(screen_of(shared_report(), {}, {}, unproven), Not(HasSubstr("worst: ")));
}

TEST(ReportScreen, SaysHowMuchOfThePreemptionTheNamedOneTook) {
  auto preempted = usual_context();
  preempted.verify.worst_runs[0].preempted_by_time = {80'000};  // of 200 us
  EXPECT_THAT(screen_of(shared_report(), {}, {.columns = 200}, preempted),
              HasSubstr("took 2.500 ms: 200.0 us preempted, 80.00 us of it by cc1plus\n"));
}

TEST(ReportScreen, NamesWhatTheThreadOfTheWorstRunDidMeanwhile) {
  auto waited = usual_context();
  auto& worst = waited.verify.worst_runs[0];  // of 2.5 ms
  worst.preempted.reset();
  worst.start_latency = analysis::Duration{2'400'000};
  worst.behind = {.callback = shared_report().callbacks[0].index, .time = {2'000'000}};
  EXPECT_THAT(screen_of(shared_report(), {}, {.columns = 200}, waited),
              HasSubstr("instance 3 at +1.500 ms: 2.000 ms of 2.500 ms behind plan timer 20 ms\n"));
  worst.behind->time = {1'200'000};  // less than half of it all
  EXPECT_THAT(screen_of(shared_report(), {}, {.columns = 200}, waited),
              HasSubstr("instance 3 at +1.500 ms took 2.500 ms: 2.400 ms waiting to start"));
}

}  // namespace
}  // namespace cie::viewer_export
