// What the report's first screen says of the run that took longest.
#include "report_screens.hpp"
#include "sample_report.hpp"

#include <cstdint>
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

// The words of the worst run, 2.5 ms of which its CPU was idle for 1.5 ms while it was runnable.
std::string idle_words(const analysis::ThreadSchedReport& sched, std::int64_t blocked = 0) {
  auto context = usual_context();
  auto& worst = context.verify.worst_runs[0];
  worst.preempted = analysis::Duration{1'700'000};
  worst.idle = analysis::Duration{1'500'000};
  worst.execution = analysis::Duration{800'000 - blocked};
  worst.blocked = analysis::Duration{blocked};
  auto report = shared_report();
  report.callbacks[1].threads.resize(1);
  report.threads[1].sched = sched;
  return screen_of(report, {}, {.columns = 300}, context);
}

analysis::ThreadSchedReport policy(const std::string& name, std::uint64_t runtime_ns = 0) {
  analysis::ThreadSchedReport sched;
  sched.policy_name = name;
  sched.runtime_ns = runtime_ns;
  return sched;
}

TEST(ReportScreen, SaysWhyTheWorstRunDidNotRunWhileItsCpuWasIdle) {
  const std::string begin = "took 2.500 ms: 1.500 ms runnable while its CPU was idle (";
  const std::string end = "), 800.0 us executing, 200.0 us preempted by cc1plus\n";
  auto sched = policy("SCHED_DEADLINE", 700'000);
  EXPECT_THAT(
      idle_words(sched),
      HasSubstr(begin + "throttled: its SCHED_DEADLINE runtime of 700.0 us was used up" + end));
  EXPECT_THAT(idle_words(sched, 50'000),
              HasSubstr(begin + "perhaps throttled by SCHED_DEADLINE), "))
      << "what blocks may get more runtime before all is used up";
  sched.runtime_ns = 800'000;
  EXPECT_THAT(idle_words(sched), HasSubstr(begin + "perhaps throttled by SCHED_DEADLINE" + end));
  sched.runtime_ns = 700'000;
  sched.flags = 0x02;  // SCHED_FLAG_RECLAIM
  EXPECT_THAT(idle_words(sched), HasSubstr(begin + "perhaps throttled by SCHED_DEADLINE" + end));
  EXPECT_THAT(idle_words(policy("SCHED_FIFO")),
              HasSubstr(begin + "perhaps throttled by sched_rt_runtime_us" + end));
  EXPECT_THAT(idle_words(policy("SCHED_OTHER")),
              HasSubstr(begin + "perhaps throttled by cpu.max of a cgroup" + end));
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

TEST(ReportScreen, CountsLateInstancesThatNeverEnded) {
  auto report = shared_report();
  auto& callback = report.callbacks[0];
  callback.incomplete = 1;
  callback.response_deadline = analysis::Duration{1'000'000};
  callback.late = 0;
  const auto text = [&report] { return screen_of(report, {}, {.columns = 200}); };
  EXPECT_THAT(text(), testing::ContainsRegex("plan timer 20 ms .* 7\\+1 .* 1\\.000ms +0 "));
  callback.late_open = 1;
  EXPECT_THAT(text(), testing::ContainsRegex("plan timer 20 ms .* 7\\+1 .* 1\\.000ms +0\\+1 "));
}

TEST(ReportScreen, NamesTheLongestRunsThatDidNotEndAndCountsTheOthers) {
  auto report = shared_report();
  for (std::uint32_t i = 0; i < 4; ++i) {
    auto callback = report.callbacks[0];
    callback.index = analysis::CallbackIndex{3 + i};
    callback.logical_id = "/a/t" + std::to_string(i) + "@Timer(1000000)";
    callback.node = "/a/t" + std::to_string(i);
    callback.period_ns = 1'000'000;
    callback.incomplete = 1;
    callback.longest_open = analysis::OpenRun{.seq = i, .until_end = {(i + 1) * 100'000'000}};
    report.callbacks.push_back(callback);
  }
  const auto text = [&report] { return screen_of(report, {}, {.columns = 300}); };
  EXPECT_THAT(text(),
              HasSubstr("  did not end: t3 timer 1 ms, instance 3 began 400.0 ms before the "
                        "end; t2 timer 1 ms, instance 2 began 300.0 ms before the end; ... 2 "
                        "more callbacks\n"));
  report.callbacks.pop_back();
  report.callbacks.pop_back();
  EXPECT_THAT(text(), HasSubstr("t1 timer 1 ms, instance 1 began 200.0 ms before the end; t0 timer "
                                "1 ms, instance 0 began 100.0 ms before the end\n"));
}

}  // namespace
}  // namespace cie::viewer_export
