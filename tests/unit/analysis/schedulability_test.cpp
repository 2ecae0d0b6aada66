#include <cie/analysis/schedulability.hpp>

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
    thread.pid = 1;
    thread.tid = 100 + static_cast<std::int64_t>(report.threads.size());
    thread.callbacks = {id};
    thread.sched = ThreadSchedReport{.moment = "applied",
                                     .policy = static_cast<std::int32_t>(p.policy),
                                     .policy_name = std::string(policy_name(p.policy)),
                                     .priority = p.priority,
                                     .cpus = p.cpus};
    auto& callback = report.callbacks.emplace_back();
    callback.logical_id = id;
    callback.pid = 1;
    callback.threads = {{.tid = thread.tid, .name = id, .instances = 2}};
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
  ASSERT_TRUE(result.deadline);
  EXPECT_EQ(result.deadline->reserved_ppb, 300'000'000);
  EXPECT_EQ(result.deadline->admissible_ppb, 1'900'000'000) << "of two CPUs";
  EXPECT_TRUE(result.deadline->is_guaranteed);
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
  worker.pid = 1;
  worker.tid = 77;
  worker.name = "recv";
  worker.sched = system.sched(0);
  system.report.threads.push_back(worker);
  EXPECT_THAT(system.analyzed().outside, ElementsAre("thread 77 \"recv\" (SCHED_FIFO 30)"));
}

}  // namespace
}  // namespace cie::analysis
