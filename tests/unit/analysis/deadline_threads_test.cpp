#include "task_system.hpp"

#include <cstdint>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(DeadlineThreads, JudgesDeadlineThreadsByAdmissionAndEdf) {
  TaskSystem system;
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
  EXPECT_EQ(result.deadline[0].is_guaranteed, true);
  EXPECT_EQ(result.callbacks[0].bound_ns, 8);
  EXPECT_EQ(result.callbacks[0].runtime_ns, 3);
  EXPECT_EQ(result.callbacks[1].runtime_ns, std::nullopt) << "SCHED_FIFO has none";
  EXPECT_FALSE(result.callbacks[0].executes_beyond_runtime()) << "2 of 3";
  EXPECT_EQ(result.callbacks[0].method, BoundMethod::deadline_server);
  // Jitter 5 of the server: 4 -> 4 + ceil(9/10)·3 = 7 -> 4 + ceil(12/10)·3 = 10 -> 4 + 2·3 = 10
  EXPECT_EQ(result.callbacks[1].bound_ns, 10);
  system.report.callbacks[0].execution_time = extremes(0, 4);
  result = system.analyzed();
  EXPECT_EQ(result.callbacks[0].bound_ns, std::nullopt);
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("below what its releases demand"));
  EXPECT_TRUE(result.callbacks[0].executes_beyond_runtime()) << "4 of 3";
  EXPECT_EQ(result.deadline[0].is_guaranteed, true) << "of its runtime";
}

// Threads of SCHED_DEADLINE that execute for 2 of every 20 and may for `runtime` of every period.
TaskSystem servers(const std::vector<std::vector<std::uint32_t>>& cpus, std::uint64_t runtime,
                   std::uint64_t period = 10) {
  TaskSystem system;
  for (const auto& allowed : cpus) {
    const auto index = system.report.threads.size();
    system.add("on" + std::to_string(index),
               {.execution = 2, .inter_arrival = 20, .policy = Policy::deadline, .cpus = allowed});
    system.sched(index).runtime_ns = runtime;
    system.sched(index).deadline_ns = system.sched(index).period_ns = period;
  }
  return system;
}

TEST(DeadlineThreads, BoundsNoDeadlineThreadThatWaits) {
  auto system = servers({{0}}, 5);
  constexpr const char* kSpec = "callback_groups:\n  - {id: on0, response_deadline: 50}\n";
  EXPECT_EQ(system.analyzed(kSpec).callbacks[0].bound_ns, 10);
  system.report.callbacks[0].blocked = extremes(0, 1);
  const auto result = system.analyzed(kSpec);
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("it waits within an instance"));
  EXPECT_EQ(result.callbacks[0].bound_ns, std::nullopt);
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
}

TEST(DeadlineThreads, JudgesDeadlineThreadsThatShareCpusTogether) {
  const auto apart = servers({{0}, {1}}, 9).analyzed();
  ASSERT_EQ(apart.deadline.size(), 2U);
  for (std::uint32_t i = 0; i < 2; ++i) {
    EXPECT_THAT(apart.deadline[i].cpus, ElementsAre(i));
    EXPECT_EQ(apart.deadline[i].reserved_ppb, 900'000'000);
    EXPECT_EQ(apart.deadline[i].is_guaranteed, true);
  }
  const auto crowded = servers({{1}, {0}, {0}}, 6).analyzed();
  ASSERT_EQ(crowded.deadline.size(), 2U);
  EXPECT_EQ(crowded.deadline[0].is_guaranteed, false) << "12 of 10 on CPU 0";
  EXPECT_EQ(crowded.deadline[1].is_guaranteed, true);
  EXPECT_EQ(crowded.callbacks[0].bound_ns, 10);
  EXPECT_EQ(crowded.callbacks[1].bound_ns, std::nullopt);
  const auto by_another = servers({{0, 1}, {2, 3}, {1, 2}}, 1).analyzed();
  ASSERT_EQ(by_another.deadline.size(), 1U);
  EXPECT_THAT(by_another.deadline[0].cpus, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(by_another.deadline[0].servers, 3U);
}

// 11 of 10 on CPU 0, whatever the third one might do with CPU 1.
TEST(DeadlineThreads, LendNoCpuToWhoMayNotUseIt) {
  auto system = servers({{0}, {0}, {0, 1}}, 5);
  system.sched(0).runtime_ns = 6;
  system.sched(2).runtime_ns = 1;
  const auto result = system.analyzed();
  ASSERT_EQ(result.deadline.size(), 1U);
  EXPECT_EQ(result.deadline[0].is_guaranteed, false);
  system.sched(0).runtime_ns = 4;  // 10 of 10 with the third one
  EXPECT_EQ(system.analyzed().deadline[0].is_guaranteed, true);
}

// One that ended before joins no others.
TEST(DeadlineThreads, ShareCpusOnlyWithThoseThatLive) {
  auto system = servers({{0}, {1}, {0, 1}}, 9);
  const auto later = system.add_process({100}, {199});
  const auto earlier = system.add_process({0}, {99});
  for (std::size_t i = 0; i < 3; ++i) {
    system.report.threads[i].process = system.report.callbacks[i].process = i < 2 ? later : earlier;
  }
  EXPECT_EQ(system.analyzed().deadline.at(0).is_guaranteed, true);
  system.report.processes[1].lived.to = {100};
  EXPECT_EQ(system.analyzed().deadline.at(0).is_guaranteed, false);
}

TEST(DeadlineThreads, AreUndecidedBesideOneOfUnknownParameters) {
  const auto reason_of = [](const auto& change) {
    auto system = servers({{0}, {1}}, 5);
    change(system);
    const auto result = system.analyzed("callback_groups:\n  - {id: on0, response_deadline: 10}\n");
    EXPECT_EQ(result.deadline[0].is_guaranteed, std::nullopt);
    EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
    return result.callbacks[0].reason;
  };
  EXPECT_THAT(reason_of([](TaskSystem& system) { system.report.threads[1].sched.reset(); }),
              HasSubstr("the parameters of thread 102 are not known"));
  EXPECT_THAT(reason_of([](TaskSystem& system) { system.sched(1).cpus.clear(); }),
              HasSubstr("the CPUs of thread 102 are not known"));
  EXPECT_THAT(reason_of([](TaskSystem& system) {
                system.report.threads[1].former = {system.sched(1)};
                system.sched(1).policy = static_cast<std::int32_t>(Policy::other);
              }),
              HasSubstr("the parameters of thread 102 changed"));
}

// 2 of every 9 with 5 of every 10: never too much, but a job may come when the budget is spent.
TEST(DeadlineThreads, AreNotOverloadedByReleasesThatComeEarly) {
  auto system = servers({{0}}, 5);
  system.report.callbacks[0].inter_arrival = extremes(9, 11);
  constexpr const char* kSpec = "callback_groups:\n  - {id: on0, response_deadline: 10}\n";
  auto result = system.analyzed(kSpec);
  EXPECT_THAT(result.callbacks[0].reason, HasSubstr("before its runtime is renewed"));
  EXPECT_EQ(result.callbacks[0].meets_deadline(), std::nullopt);
  system.report.callbacks[0].execution_time = extremes(0, 5);  // 5 of 9
  result = system.analyzed(kSpec);
  EXPECT_EQ(result.callbacks[0].meets_deadline(), false);
}

TEST(DeadlineThreads, CountAgainstOthersThoughTheyNeverRan) {
  auto system = textbook();
  auto& never = system.report.callbacks[0];
  never.threads.clear();
  never.execution_time.reset();
  never.inter_arrival.reset();
  const auto result = system.analyzed(
      "callback_groups:\n  - {id: high, policy: SCHED_DEADLINE, runtime: 3000, deadline: 7000, "
      "period: 7000}\n");
  EXPECT_EQ(result.callbacks[1].bound_ns, 3 + 2 * 3000) << "two budgets may follow each other";
}

TEST(DeadlineThreads, AdmitsDeadlineThreadsThatLivedAtTheSameTime) {
  auto system = servers({{0}, {0}}, 6);
  for (std::size_t i = 0; i < 2; ++i) {
    const Timestamp from{static_cast<std::int64_t>(100 * i)};
    const auto process = system.add_process(from, {from.ns + 99});
    system.report.threads[i].process = system.report.callbacks[i].process = process;
  }
  auto result = system.analyzed();
  ASSERT_EQ(result.deadline.size(), 1U);
  EXPECT_EQ(result.deadline[0].is_guaranteed, true);
  EXPECT_EQ(result.deadline[0].servers, 1U);
  EXPECT_EQ(result.deadline[0].reserved_ppb, 600'000'000);
  system.report.processes[0].lived.to = {100};
  result = system.analyzed();
  EXPECT_EQ(result.deadline[0].is_guaranteed, false);
  EXPECT_EQ(result.deadline[0].servers, 2U);
}

TEST(DeadlineThreads, HasNoBoundBelowADeadlineThreadThatReclaims) {
  auto system = servers({{0}}, 3);
  system.add("below", {.execution = 4, .inter_arrival = 100, .priority = 50});
  EXPECT_EQ(system.analyzed().callbacks[1].bound_ns, 10);  // 4 + 2·3, as two budgets may follow
  system.sched(0).flags = 2;                               // SCHED_FLAG_RECLAIM
  EXPECT_THAT(system.analyzed().callbacks[1].reason, HasSubstr("SCHED_FLAG_RECLAIM"));
  system.sched(0).flags = 0;
  system.sched(0).period_ns = 0;
  EXPECT_THAT(system.analyzed().callbacks[1].reason, HasSubstr("no sound ones"));
}

TEST(DeadlineThreads, AdmitsTheDeadlinesOfEachHostByItsOwnCpus) {
  TaskSystem system;
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
    EXPECT_EQ(result.deadline[i].is_guaranteed, true);
  }
}

}  // namespace
}  // namespace cie::analysis
