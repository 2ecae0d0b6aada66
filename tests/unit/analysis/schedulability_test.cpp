#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/schedulability.hpp>

#include "support/two_hosts.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Summary extremes(std::int64_t min, std::int64_t max) {
  Summary summary;
  summary.count = 2;
  summary.min = min;
  summary.max = max;
  return summary;
}

// A report of callbacks on threads of their own, all on CPU 0 unless a test says otherwise.
class System {
 public:
  struct Parameters {
    std::int64_t execution = 0;
    std::int64_t inter_arrival = 0;
    std::int64_t response = 0;
    Policy policy = Policy::fifo;
    std::uint32_t priority = 0;
    std::vector<std::uint32_t> cpus{0};
  };

  CallbackReport& add(const std::string& id, const Parameters& p) {
    auto& thread = report.threads.emplace_back();
    thread.index = ThreadIndex{static_cast<std::uint32_t>(report.threads.size() - 1)};
    thread.tid = 100 + static_cast<std::int64_t>(report.threads.size());
    thread.callbacks = {id};
    thread.sched = ThreadSchedReport{.moment = SchedMoment::applied,
                                     .policy = static_cast<std::int32_t>(p.policy),
                                     .policy_name = std::string(policy_name(p.policy)),
                                     .priority = p.priority,
                                     .cpus = p.cpus};
    auto& callback = report.callbacks.emplace_back();
    callback.logical_id = id;
    callback.index = CallbackIndex{static_cast<std::uint32_t>(report.callbacks.size() - 1)};
    callback.threads = {{.thread = thread.index, .tid = thread.tid, .name = id, .instances = 2}};
    callback.execution_time = extremes(0, p.execution);
    callback.inter_arrival = extremes(p.inter_arrival, p.inter_arrival);
    callback.response_time = extremes(0, p.response);
    return callback;
  }
  ThreadSchedReport& sched(std::size_t index) { return *report.threads[index].sched; }

  SchedulabilityReport analyzed(const std::string& spec_text = {}) const {
    if (spec_text.empty()) return schedulability_of(report, nullptr);
    const auto spec = SchedulingSpec::parse(spec_text, "spec.yaml");
    return schedulability_of(report, &spec);
  }

  Report report;
};

// Burns & Wellings' example, C = 3, 3, 5 and T = 7, 12, 20: responses 3, 6 and 20.
System textbook() {
  System system;
  system.add("high", {.execution = 3, .inter_arrival = 7, .response = 3, .priority = 30});
  system.add("mid", {.execution = 3, .inter_arrival = 12, .response = 6, .priority = 20});
  system.add("low", {.execution = 5, .inter_arrival = 20, .response = 14, .priority = 10});
  return system;
}

TEST(Schedulability, BoundsCallbacksByWhatWasMeasured) {
  const auto result = textbook().analyzed();
  ASSERT_EQ(result.callbacks.size(), 3U);
  EXPECT_EQ(result.callbacks[0].bound_ns, 3);
  EXPECT_EQ(result.callbacks[1].bound_ns, 6);
  EXPECT_EQ(result.callbacks[2].bound_ns, 20);
  EXPECT_EQ(result.callbacks[2].observed_ns, 14);
  EXPECT_EQ(result.callbacks[2].method, BoundMethod::fixed_priority);
  EXPECT_FALSE(result.has_finding());
  // 3/7 + 3/12 + 5/20, each rounded down to parts per billion.
  ASSERT_EQ(result.cpus.size(), 1U);
  EXPECT_EQ(result.cpus[0].real_time_ppb, 428'571'428 + 250'000'000 + 250'000'000);
}

TEST(Schedulability, PrefersWhatIsDeclared) {
  const auto result = textbook().analyzed(R"(
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

TEST(Schedulability, SaysWhatIsMissing) {
  auto system = textbook();
  system.report.callbacks[0].execution_time.reset();
  system.report.callbacks[1].inter_arrival.reset();
  auto result = system.analyzed();
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("record with --kernel"));
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("released once"));
  EXPECT_THAT(result.callbacks[2].reason, HasSubstr("execution time of high"));
  system.report.callbacks[0].threads.push_back({.tid = 9, .name = {}, .instances = 1});
  system.report.threads[1].callbacks.push_back("another");
  system.report.threads[2].sched.reset();
  result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].reason, "it ran on several threads");
  EXPECT_THAT(result.callbacks[1].reason, HasSubstr("its thread runs 2 callbacks"));
  EXPECT_THAT(result.callbacks[2].reason, HasSubstr("parameters of its thread"));
  EXPECT_FALSE(result.has_finding()) << "what cannot be said is no finding";
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
  const auto result = system.analyzed("callback_groups:\n  - {id: low, wcet: 1}\n");
  EXPECT_EQ(result.callbacks[2].bound_ns, 7);  // 1 -> 7 -> 7
  EXPECT_EQ(result.callbacks[2].explanations.at(0).kind, "overrun");
  EXPECT_TRUE(result.callbacks[2].is_flagged) << "an overrun of 4 does not explain 13";
}

TEST(Schedulability, JudgesDeadlineThreadsByAdmissionAndEdf) {
  System system;
  system.add("a", {.execution = 2,
                   .inter_arrival = 10,
                   .response = 5,
                   .policy = Policy::deadline,
                   .cpus = {0, 1}});
  system.sched(0).runtime_ns = 3;
  system.sched(0).deadline_ns = 8;
  system.sched(0).period_ns = 10;
  system.add("below", {.execution = 4, .inter_arrival = 100, .response = 9, .priority = 50});
  auto result = system.analyzed();
  ASSERT_EQ(result.deadline.size(), 1U);
  EXPECT_EQ(result.deadline[0].reserved_ppb, 300'000'000);
  EXPECT_EQ(result.deadline[0].admissible_ppb, 1'900'000'000) << "of two CPUs";
  EXPECT_TRUE(result.deadline[0].is_guaranteed);
  EXPECT_EQ(result.callbacks[0].bound_ns, 8);
  EXPECT_EQ(result.callbacks[0].method, BoundMethod::deadline_server);
  // Jitter 5 of the server: 4 -> 4 + ceil(9/10)·3 = 7 -> 4 + ceil(12/10)·3 = 10 -> 4 + 2·3 = 10
  EXPECT_EQ(result.callbacks[1].bound_ns, 10);
  system.report.callbacks[0].execution_time = extremes(0, 4);
  result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].bound_ns, std::nullopt);
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("below what its releases demand"));
}

TEST(Schedulability, NamesRealTimeThreadsThatAreInNoBound) {
  auto system = textbook();
  ThreadReport worker;
  worker.tid = 77;
  worker.name = "recv";
  worker.sched = system.sched(0);
  system.report.threads.push_back(worker);
  EXPECT_THAT(system.analyzed().outside, ElementsAre("thread 77 \"recv\" (SCHED_FIFO 30)"));
}

// Each host has a CPU 0 and threads of the same ids. `plan` executes for 10 every 100, `show` for
// 20 every 200; on the robot `plan` is the more urgent one, on the desk `show`.
TEST(Schedulability, OfTwoHostsIsThatOfEachAlone) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - {id: plan, wcet: 10, min_inter_arrival: 100}\n"
      "  - {id: show, wcet: 20, min_inter_arrival: 200}\n",
      "spec.yaml");
  const auto trace = test::application_on_two_hosts();
  const auto report = test::analyze(trace).report;
  const auto result = schedulability_of(report, &spec);
  const ReportRows rows(report);
  std::map<std::pair<std::string, std::string>, std::optional<std::int64_t>> bounds;
  for (const auto& callback : result.callbacks)
    bounds[{rows.process_of(callback).host, callback.logical_id}] = callback.bound_ns;
  EXPECT_EQ((bounds[{"robot", "plan"}]), 10);
  EXPECT_EQ((bounds[{"robot", "show"}]), 20 + 10);
  EXPECT_EQ((bounds[{"desk", "plan"}]), 10 + 20);
  EXPECT_EQ((bounds[{"desk", "show"}]), 20);
  ASSERT_EQ(result.cpus.size(), 2U);
  for (const auto& demand : result.cpus) {
    EXPECT_EQ(demand.cpu, 0U);
    EXPECT_EQ(demand.real_time_ppb, 200'000'000) << "of " << demand.host;  // 10 / 100 + 20 / 200
  }
  EXPECT_NE(result.cpus[0].host, result.cpus[1].host);
}

TEST(Schedulability, AdmitsTheDeadlinesOfEachHostByItsOwnCpus) {
  System system;
  system.add("a", {.policy = Policy::deadline});
  system.add("b", {.policy = Policy::deadline});
  system.report.trace.hosts = {"desk", "robot"};
  for (std::uint32_t i = 0; i < 2; ++i) {
    auto& process = system.report.processes.emplace_back();
    process.index = ProcessIndex{i};
    process.host_index = HostIndex{i};
    process.host = system.report.trace.hosts[i];
    system.report.threads[i].process = system.report.callbacks[i].process = process.index;
    system.sched(i).runtime_ns = 60;
    system.sched(i).deadline_ns = system.sched(i).period_ns = 100;
  }
  const auto result = system.analyzed();
  ASSERT_EQ(result.deadline.size(), 2U);  // together they would demand 120 % of one CPU
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(result.deadline[i].host, system.report.trace.hosts[i]);
    EXPECT_EQ(result.deadline[i].servers, 1U);
    EXPECT_EQ(result.deadline[i].reserved_ppb, 600'000'000);
    EXPECT_TRUE(result.deadline[i].is_guaranteed);
  }
}

}  // namespace
}  // namespace cie::analysis
