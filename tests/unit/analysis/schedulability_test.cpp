#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/schedulability.hpp>

#include "support/two_hosts.hpp"
#include "task_system.hpp"

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Schedulability, BoundsCallbacksByWhatWasMeasured) {
  const auto result = textbook().analyzed();
  ASSERT_EQ(result.callbacks.size(), 3U);
  EXPECT_EQ(result.callbacks[0].bound_ns, 3);
  EXPECT_EQ(result.callbacks[1].bound_ns, 6);
  EXPECT_EQ(result.callbacks[2].bound_ns, 20);
  EXPECT_EQ(result.callbacks[2].observed_ns, 14);
  EXPECT_EQ(result.callbacks[2].method, BoundMethod::fixed_priority);
  EXPECT_FALSE(result.has_finding());
  // 3/7 + 3/12 + 5/20, each rounded up to parts per billion.
  ASSERT_EQ(result.cpus.size(), 1U);
  EXPECT_EQ(result.cpus[0].real_time_ppb, 428'571'429 + 250'000'000 + 250'000'000);
}

TEST(Schedulability, PrefersWhatIsDeclared) {
  auto system = textbook();
  system.report.callbacks[2].inter_arrival = extremes(40, 40);
  const auto result = system.analyzed(R"(
callback_groups:
  - {id: low, wcet: 6, min_inter_arrival: 40, response_deadline: 22}
  - {id: mid, response_deadline: 5}
)");
  // 6 -> 12 -> 6+6+3 = 15 -> 6+9+6 = 21 -> 6+9+6 = 21
  EXPECT_EQ(result.callbacks[2].bound_ns, 21);
  EXPECT_EQ(result.callbacks[2].execution->source, ParameterSource::declared);
  EXPECT_EQ(result.callbacks[2].meets_deadline(), true);
  EXPECT_EQ(result.callbacks[1].meets_deadline(), false) << "6 is beyond 5";
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
  EXPECT_TRUE(result.has_finding());
}

TEST(Schedulability, CountsWaitingWithinACallbackAsExecution) {
  auto system = textbook();
  system.report.callbacks[0].blocked = extremes(0, 1);
  const auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].bound_ns, 4);
  EXPECT_EQ(result.callbacks[1].bound_ns, 7);
}

TEST(Schedulability, CountsWaitingBesidesADeclaredWcet) {
  auto system = textbook();
  system.report.callbacks[0].blocked = extremes(0, 2);
  const auto result = system.analyzed("callback_groups:\n  - {id: high, wcet: 4}\n");
  EXPECT_EQ(result.callbacks[0].execution->ns, 6) << "4 on a CPU, 2 waiting";
  EXPECT_EQ(result.callbacks[0].waiting_ns, 2);
  EXPECT_EQ(result.callbacks[0].bound_ns, 6);
}

// Whatever is declared, a run that is missing may have waited.
TEST(Schedulability, DecidesNothingOfADeclaredWcetWhereRunsAreMissing) {
  constexpr const char* kSpec = "callback_groups:\n  - {id: high, wcet: 3, response_deadline: 4}\n";
  auto system = textbook();
  auto& high = system.report.callbacks[0];
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), true);
  high.may_lack_runs = true;
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), std::nullopt);
  high.may_lack_runs = false;
  high.incomplete = 2;
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), std::nullopt);
}

TEST(Schedulability, NeverMeetsADeadlineThatWasMissed) {
  constexpr const char* kSpec = "callback_groups:\n  - {id: high, response_deadline: 4}\n";
  auto system = textbook();
  auto& high = system.report.callbacks[0];
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), true) << "the bound is 3";
  high.response_time = extremes(0, 5);
  high.wakeup_latency = extremes(0, 2);  // which explains the 2 above the bound
  auto result = system.analyzed(kSpec);
  EXPECT_EQ(result.callbacks[0].bound_ns, 3);
  EXPECT_EQ(result.callbacks[0].meets_deadline(), false);
  EXPECT_TRUE(result.has_finding());

  high.response_time.reset();
  high.response_time_lower = extremes(0, 5);
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), false) << "it took 5 at least";

  system.sched(0).policy = static_cast<std::int32_t>(Policy::other);
  result = system.analyzed(kSpec);
  EXPECT_EQ(result.callbacks[0].bound_ns, std::nullopt);
  EXPECT_EQ(result.callbacks[0].meets_deadline(), false) << "seen is seen, bound or not";
}

// As some say that there is no limit.
TEST(Schedulability, KeepsADeadlineOrAPeriodBeyondSignedNumbers) {
  constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
  constexpr std::uint64_t kBeyond = kMost / 2 + 1;
  for (const auto declared : {kBeyond, kMost}) {
    TaskSystem system;
    auto& high =
        system.add("high", {.execution = 3, .inter_arrival = 20, .response = 3, .priority = 90});
    high.deadline_ns = declared;
    const auto of_deadline = system.analyzed().callbacks[0];
    EXPECT_EQ(of_deadline.meets_deadline(), true);
    EXPECT_EQ(of_deadline.deadline->ns, std::numeric_limits<std::int64_t>::max());
    system.report.callbacks[0].period_ns = declared;
    EXPECT_EQ(system.analyzed().callbacks[0].period->ns, std::numeric_limits<std::int64_t>::max());
  }
}

TEST(Schedulability, NeverMeetsADeadlineThatARunInProgressMissed) {
  constexpr const char* kSpec = "callback_groups:\n  - {id: high, response_deadline: 4}\n";
  auto system = textbook();
  auto& high = system.report.callbacks[0];
  high.incomplete = 1;
  high.longest_open = OpenRun{.seq = 9, .until_end = {3}};
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), true) << "it may have ended";
  high.longest_open->response_least = Duration{4};
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].has_missed_deadline(), false);
  high.longest_open->response_least = Duration{5};
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), false);
}

TEST(Schedulability, OfARunInProgressTheReleaseIsAsNearAsItIs) {
  constexpr const char* kSpec =
      "callback_groups:\n  - {id: high, min_inter_arrival: 7, response_deadline: 4}\n";
  auto system = textbook();
  system.report.callbacks[0].shortest_inter_arrival = Duration{7};
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].meets_deadline(), true);
  system.report.callbacks[0].shortest_inter_arrival = Duration{6};
  const auto result = system.analyzed(kSpec);
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
  EXPECT_THAT(result.callbacks[0].broken_declaration, HasSubstr("declared are 0.0 us"));
}

TEST(Schedulability, DecidesNothingWithoutExecutionTimes) {
  auto system = textbook();
  for (auto& callback : system.report.callbacks)
    callback.execution_time.reset();
  constexpr const char* kSpec = R"(
callback_groups:
  - {id: mid, response_deadline: 50}
  - {id: low, response_deadline: 50}
)";
  auto result = system.analyzed(kSpec);
  EXPECT_FALSE(result.has_finding());
  EXPECT_EQ(result.deadlines(), 2U);
  EXPECT_EQ(result.decided_deadlines(), 0U);
  EXPECT_TRUE(result.is_undecided());
  EXPECT_EQ(result.why_undecided(), "execution times unknown");
  EXPECT_EQ(result.cpus.at(0).real_time_ppb, std::nullopt) << "unknown is not 0";
  EXPECT_FALSE(system.analyzed().is_undecided()) << "there is no deadline";

  // Of one callback it is known, but not of what may preempt it.
  system.report.callbacks[2].execution_time = extremes(0, 5);
  result = system.analyzed(kSpec);
  EXPECT_EQ(result.callbacks[2].meets_deadline(), std::nullopt);
  EXPECT_TRUE(result.is_undecided());
  EXPECT_EQ(result.why_undecided(), "why is said of each");
}

TEST(Schedulability, OfOtherCpusAndPoliciesIsNotDisturbed) {
  auto system = textbook();
  system.sched(0).cpus = {1};
  system.sched(1).policy = static_cast<std::int32_t>(Policy::other);
  system.sched(1).policy_name = "SCHED_OTHER";
  const auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[2].bound_ns, 5);
  EXPECT_EQ(result.callbacks[1].bound_ns, std::nullopt);
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("SCHED_OTHER gives no guarantee"));
}

TEST(Schedulability, NamesWhatItCannotBoundAndStillCountsItAgainstOthers) {
  auto system = textbook();
  system.sched(0).cpus = {0, 1};
  system.sched(1).policy = static_cast<std::int32_t>(Policy::round_robin);
  const auto result = system.analyzed();
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("may run on 2 CPUs"));
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("SCHED_RR takes turns"));
  EXPECT_EQ(result.callbacks[2].bound_ns, 20) << "both may preempt it";
}

// Who has the kernel's events needs no advice to record them.
TEST(Schedulability, AdvisesToRecordWithTheKernelWhereNothingWasMeasured) {
  auto system = textbook();
  auto& high = system.report.callbacks[0];
  high.longest_unmeasured = Duration{1'000};
  constexpr const char* kSpec = "callback_groups:\n  - {id: high, wcet: 3}\n";
  EXPECT_THAT(system.analyzed(kSpec).callbacks[0].reason,
              HasSubstr("record without gaps in the kernel's record"));
  high.execution_time.reset();
  EXPECT_THAT(system.analyzed(kSpec).callbacks[0].reason, HasSubstr("record with --kernel"));
}

TEST(Schedulability, SaysWhatIsMissing) {
  auto system = textbook();
  system.report.callbacks[0].execution_time.reset();
  system.report.callbacks[1].inter_arrival.reset();
  auto result = system.analyzed();
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("record with --kernel"));
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("released once"));
  EXPECT_THAT(result.callbacks[2].reason, HasSubstr("execution time of high"));
  system.report.callbacks[1].instances = system.report.callbacks[1].cut = 1;
  EXPECT_THAT(system.analyzed().callbacks[1].reason, HasSubstr("its releases are not known"));
  system.report.callbacks[0].threads.push_back({.tid = 9, .name = {}, .instances = 1});
  system.report.threads[1].callbacks.push_back("another");
  system.report.threads[2].sched.reset();
  result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].reason, "it ran on several threads");
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("its thread runs 2 callbacks"));
  EXPECT_THAT(result.callbacks[2].reason, HasSubstr("parameters of its thread"));
  EXPECT_FALSE(result.has_finding()) << "what cannot be said is no finding";
}

// 5 + 3 and 3 of the others, as if they had threads of their own.
TEST(Schedulability, CountsARivalWhicheverThreadsItRanOn) {
  auto system = textbook();
  const auto run_on = [&system](std::size_t callback, std::size_t thread) {
    const auto& on = system.report.threads[thread];
    system.report.callbacks[callback].threads.push_back(
        {.thread = on.index, .tid = on.tid, .name = {}, .instances = 1});
    system.report.threads[thread].callbacks.push_back(system.report.callbacks[callback].logical_id);
  };
  run_on(0, 1);
  run_on(1, 0);
  auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].reason, "it ran on several threads");
  EXPECT_EQ(result.callbacks[2].bound_ns, 20) << "each instance runs once";
  EXPECT_EQ(result.cpus[0].real_time_ppb, 428'571'429 + 250'000'000 + 250'000'000);
  // As urgent as the most urgent of them.
  system.sched(1).priority = 5;
  EXPECT_EQ(system.analyzed().callbacks[2].bound_ns, 20);
  system.sched(0).priority = 5;
  EXPECT_EQ(system.analyzed().callbacks[2].bound_ns, 5);
}

TEST(Schedulability, CountsARivalAsUrgentAsItEverWas) {
  auto system = textbook();
  system.report.threads[0].former = {system.sched(0), system.sched(0)};
  system.report.threads[0].former.back().priority = 5;
  system.sched(0).policy = static_cast<std::int32_t>(Policy::other);
  const auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[2].bound_ns, 20);
  EXPECT_EQ(result.callbacks[0].reason, "the parameters of its thread changed");
}

TEST(Schedulability, HasNoBoundBesideWhatIsUnknown) {
  const auto reason_of = [](const auto& change) {
    auto system = textbook();
    change(system);
    const auto result =
        system.analyzed("callback_groups:\n  - {id: low, response_deadline: 100}\n");
    EXPECT_EQ(result.callbacks[2].bound_ns, std::nullopt);
    EXPECT_EQ(result.callbacks[2].meets_deadline(), std::nullopt) << "that is no miss";
    EXPECT_EQ(result.cpus[0].real_time_ppb, std::nullopt);
    return result.callbacks[2].reason;
  };
  EXPECT_THAT(reason_of([](TaskSystem& system) { system.report.threads[0].sched.reset(); }),
              HasSubstr("the parameters of thread 101 are not known: high"));
  EXPECT_THAT(reason_of([](TaskSystem& system) {
                system.report.callbacks[0].inter_arrival.reset();
                system.report.callbacks[0].instances = 2;
              }),
              HasSubstr("how often high, which may preempt it, is released"));
  EXPECT_THAT(reason_of([](TaskSystem& system) {
                system.report.callbacks[0].inter_arrival = extremes(0, 7);
              }),
              HasSubstr("releases of high, which may preempt it, coincide"));
}

// Of the one job that there was.
TEST(Schedulability, CountsARivalOnceThatWasReleasedOnce) {
  auto system = textbook();
  system.report.callbacks[0].inter_arrival.reset();
  system.report.callbacks[0].instances = 1;
  EXPECT_EQ(system.analyzed().callbacks[2].bound_ns, 5 + 3 + 3);
  system.report.callbacks[0].runs_not_seen = 1;
  EXPECT_EQ(system.analyzed().callbacks[2].bound_ns, std::nullopt);
}

TEST(Schedulability, CountsWhatTheSpecDeclaresAndNeverRan) {
  auto system = textbook();
  auto& never = system.report.callbacks[0];
  never.threads.clear();
  never.execution_time.reset();
  never.inter_arrival.reset();
  const auto bound = [&system](const std::string& affinity, int priority) {
    return system
        .analyzed("callback_groups:\n  - {id: high, wcet: 3, min_inter_arrival: 7, affinity: " +
                  affinity + ", policy: SCHED_FIFO, priority: " + std::to_string(priority) + "}\n")
        .callbacks[2]
        .bound_ns;
  };
  EXPECT_EQ(bound("[0]", 30), 20);
  EXPECT_EQ(bound("[0]", 9), 5 + 3);
  EXPECT_EQ(bound("[1]", 30), 5 + 3);
  EXPECT_EQ(system.analyzed().callbacks[2].bound_ns, 5 + 3) << "nothing is known of it";
}

// What runs no two at a time waits for the other one, however urgent it is.
TEST(Schedulability, BoundsNoCallbackWhoseGroupRunsElsewhere) {
  auto system = textbook();
  for (const auto callback : {0U, 2U}) {
    system.report.callbacks[callback].group = 7;
    system.report.callbacks[callback].shares_group = true;
  }
  auto result = system.analyzed();
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("callbacks of its group run on other threads"));
  EXPECT_EQ(result.callbacks[1].bound_ns, 6);
  system.report.callbacks[2].group = 8;
  EXPECT_EQ(system.analyzed().callbacks[0].bound_ns, 3);
}

TEST(Schedulability, AsksWhichCpusAThreadMayUse) {
  auto system = textbook();
  system.sched(0).cpus.clear();
  const auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].reason, "the CPUs that its thread may use are not known");
  EXPECT_EQ(result.callbacks[2].bound_ns, 20) << "it may use this one";
}

// 90 % of the CPU, and a million jobs before it is idle.
TEST(Schedulability, DecidesNothingThatTakesTooLongToCompute) {
  TaskSystem system;
  system.add("long",
             {.execution = 10'000'000'000, .inter_arrival = 20'000'000'000, .priority = 20});
  system.add("short", {.execution = 4'000, .inter_arrival = 10'000, .priority = 10});
  const auto result =
      system.analyzed("callback_groups:\n  - {id: short, response_deadline: 12000000000}\n");
  EXPECT_EQ(result.callbacks[1].bound_ns, std::nullopt);
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("too long to compute"));
  EXPECT_EQ(result.callbacks[1].meets_deadline(), std::nullopt);
}

TEST(Schedulability, HasNoBoundOnAnOverloadedCpu) {
  auto system = textbook();
  system.report.callbacks[0].execution_time = extremes(0, 6);
  const auto result = system.analyzed("callback_groups:\n  - {id: low, response_deadline: 1000}\n");
  EXPECT_EQ(result.callbacks[2].bound_ns, std::nullopt);
  EXPECT_THAT(result.callbacks[2].reason, HasSubstr("more than all of it"));
  EXPECT_EQ(result.callbacks[2].meets_deadline(), false);
}

TEST(Schedulability, ExplainsAnObservedResponseAboveItsBound) {
  auto system = textbook();
  auto& low = system.report.callbacks[2];
  low.response_time = extremes(0, 26);  // 6 above the bound of 20
  low.preempted = extremes(0, 9);
  low.preempted_by = {{.tid = 7, .name = "irq/9", .time = {4}},
                      {.tid = 101, .name = "high", .time = {9}}};
  auto result = system.analyzed();
  ASSERT_EQ(result.callbacks[2].explanations.size(), 1U);
  EXPECT_THAT(result.callbacks[2].explanations[0].text, HasSubstr("thread 7 (irq/9)"));
  EXPECT_EQ(result.callbacks[2].explanations[0].ns, 4);
  EXPECT_TRUE(result.callbacks[2].is_flagged) << "4 of 6 are explained";
  EXPECT_TRUE(result.has_finding());
  low.wakeup_latency = extremes(0, 2);
  result = system.analyzed();
  EXPECT_EQ(result.callbacks[2].explanations.back().kind, "kernel");
  EXPECT_FALSE(result.callbacks[2].is_flagged);
  EXPECT_FALSE(result.has_finding());
}

TEST(Schedulability, TheIdleThreadPreemptsNobody) {
  auto system = textbook();
  auto& low = system.report.callbacks[2];
  low.response_time = extremes(0, 26);  // 6 above the bound of 20
  low.preempted = extremes(0, 9);
  low.preempted_by = {{.tid = 0, .name = "swapper/0", .time = {6}}};
  const auto result = system.analyzed();
  ASSERT_EQ(result.callbacks[2].explanations.size(), 1U);
  EXPECT_EQ(result.callbacks[2].explanations[0].kind, "idle-cpu");
  EXPECT_THAT(result.callbacks[2].explanations[0].text, HasSubstr("while its CPU was idle"));
  EXPECT_EQ(result.callbacks[2].explanations[0].ns, 6);
  EXPECT_FALSE(result.callbacks[2].is_flagged);
}

// Of those that are listed the model has the one thread.
TEST(Schedulability, ExplainsByThreadsThatAreTooManyToBeListed) {
  auto system = textbook();
  auto& low = system.report.callbacks[2];
  low.response_time = extremes(0, 26);  // 6 above the bound of 20
  low.preempted = extremes(0, 15);
  low.preempted->sum = 9 + 5;
  low.preempted_by = {{.tid = 101, .name = "high", .time = {9}}};
  auto result = system.analyzed();
  ASSERT_EQ(result.callbacks[2].explanations.size(), 1U);
  EXPECT_THAT(result.callbacks[2].explanations[0].text, HasSubstr("threads beside the 1"));
  EXPECT_EQ(result.callbacks[2].explanations[0].ns, 5);
  EXPECT_TRUE(result.callbacks[2].is_flagged) << "5 of 6 are explained";
  low.preempted->sum = 9 + 6;
  EXPECT_FALSE(system.analyzed().callbacks[2].is_flagged);
}

TEST(Schedulability, ExplainsByAStartThatNoThreadOfTheModelDelayed) {
  auto system = textbook();
  auto& high = system.report.callbacks[0];  // bound 3, and nobody may delay its start
  high.response_time = extremes(0, 11);
  high.start_latency = extremes(0, 8);
  high.wakeup_latency = extremes(0, 1);
  const auto result = system.analyzed();
  ASSERT_EQ(result.callbacks[0].explanations.size(), 1U);
  EXPECT_EQ(result.callbacks[0].explanations[0].ns, 8);
  EXPECT_FALSE(result.callbacks[0].is_flagged);
}

TEST(Schedulability, ExplainsByDeclarationsThatWereNotKept) {
  auto system = textbook();
  system.report.callbacks[2].response_time = extremes(0, 20);
  constexpr const char* kSpec = "callback_groups:\n  - {id: low, wcet: 1}\n";
  auto result = system.analyzed(kSpec);
  EXPECT_EQ(result.callbacks[2].bound_ns, 7);  // 1 -> 7 -> 7
  ASSERT_EQ(result.callbacks[2].explanations.size(), 1U);
  EXPECT_EQ(result.callbacks[2].explanations[0].kind, "overrun");
  EXPECT_EQ(result.callbacks[2].explanations[0].ns, 13)
      << "for what executes for 5 the bound is 20";
  EXPECT_FALSE(result.callbacks[2].is_flagged);
  system.report.callbacks[2].response_time = extremes(0, 21);
  EXPECT_TRUE(system.analyzed(kSpec).callbacks[2].is_flagged);
}

// Its deadline may be postponed whenever it wakes up.
TEST(Schedulability, NamesRealTimeThreadsThatAreInNoBound) {
  auto system = textbook();
  ThreadReport worker;
  worker.tid = 77;
  worker.name = "recv";
  worker.sched = system.sched(0);
  system.report.threads.push_back(worker);
  EXPECT_THAT(system.analyzed().outside, ElementsAre("thread 77 \"recv\" (SCHED_FIFO 30)"));
}

// Each host has a CPU 0 and threads of the same ids. `plan` executes for 60 every 100, `show` for
// 60 every 200; on the robot `plan` is the more urgent one, on the desk `show`.
TEST(Schedulability, OfTwoHostsIsThatOfEachAlone) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - {id: plan, wcet: 60, min_inter_arrival: 100}\n"
      "  - {id: show, wcet: 60, min_inter_arrival: 200}\n",
      "spec.yaml");
  const auto trace = test::application_on_two_hosts();
  const auto report = test::analyze(trace).report;
  const auto result = schedulability_of(report, &spec);
  const ReportRows rows(report);
  std::map<std::pair<std::string, std::string>, std::optional<std::int64_t>> bounds;
  for (const auto& callback : result.callbacks)
    bounds[{rows.process_of(callback).host, callback.logical_id}] = callback.bound_ns;
  EXPECT_EQ((bounds[{"robot", "plan"}]), 60);
  EXPECT_EQ((bounds[{"robot", "show"}]), 60 + 2 * 60);
  EXPECT_EQ((bounds[{"desk", "plan"}]), 60 + 60);
  EXPECT_EQ((bounds[{"desk", "show"}]), 60);
  ASSERT_EQ(result.cpus.size(), 2U);
  for (const auto& demand : result.cpus) {
    EXPECT_EQ(demand.cpu, 0U);
    EXPECT_EQ(demand.real_time_ppb, 900'000'000) << "of " << demand.host;  // 60 / 100 + 60 / 200
  }
  EXPECT_NE(result.cpus[0].host, result.cpus[1].host);
}

}  // namespace
}  // namespace cie::analysis
