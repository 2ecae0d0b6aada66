#include <cie/analysis/response_time_analysis.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using Tasks = std::vector<FixedPriorityTask>;

FixedPriorityTask task(std::int64_t execution, std::int64_t period, std::int32_t priority) {
  return {.execution = execution, .period = period, .priority = priority};
}

// Joseph & Pandya's iteration, by hand: R3 = 3 + ceil(R/7)·2 + ceil(R/12)·3 … of the example in
// Burns & Wellings, "Real-Time Systems and Programming Languages": T = 7, 12, 20; C = 3, 3, 5.
TEST(WorstResponseTime, IsTheTextbooks) {
  const Tasks tasks{task(3, 7, 3), task(3, 12, 2), task(5, 20, 1)};
  EXPECT_EQ(worst_response_time(tasks, 0), 3);
  EXPECT_EQ(worst_response_time(tasks, 1), 6);
  // 5 -> 5+3+3 = 11 -> 5+6+3 = 14 -> 5+6+6 = 17 -> 5+9+6 = 20 -> 5+9+6 = 20
  EXPECT_EQ(worst_response_time(tasks, 2), 20);
}

// Lehoczky 1990, table 2: C = 26, 62; T = 70, 100. The seven jobs of the level-2 busy period (694)
// respond after 114, 102, 116, 104, 118, 106, 94: the fifth is the worst.
TEST(WorstResponseTime, IsLehoczkysWhereJobsOutlastTheirPeriod) {
  const Tasks tasks{task(26, 70, 2), task(62, 100, 1)};
  EXPECT_EQ(worst_response_time(tasks, 0), 26);
  EXPECT_EQ(worst_response_time(tasks, 1), 118);
}

// The same with jitter 2 of the first task, by hand: w = 4 + ceil((w + 2)/5)·2:
// 4 -> 4 + 2·2 = 8 -> 4 + 2·2 = 8; without jitter 4 -> 6 -> 4 + 2·2 = 8 as well; with T = 6:
// jitter 2: 4 -> 4 + 1·2 = 6 -> 4 + 2·2 = 8 -> 8; none: 4 -> 6 -> 6.
TEST(WorstResponseTime, GrowsWithTheJitterOfOthersAndItsOwn) {
  Tasks tasks{task(2, 6, 2), task(4, 100, 1)};
  EXPECT_EQ(worst_response_time(tasks, 1), 6);
  tasks[0].jitter = 2;
  EXPECT_EQ(worst_response_time(tasks, 1), 8);
  tasks[1].jitter = 5;
  EXPECT_EQ(worst_response_time(tasks, 1), 13);
  EXPECT_EQ(worst_response_time(tasks, 0), 4);
}

TEST(WorstResponseTime, AddsBlocking) {
  Tasks tasks{task(3, 20, 2), task(4, 20, 1)};
  tasks[0].blocking = 4;
  EXPECT_EQ(worst_response_time(tasks, 0), 7);
  EXPECT_EQ(worst_response_time(tasks, 1), 7);
}

TEST(WorstResponseTime, OfEqualPriorityCountsEachOther) {
  const Tasks tasks{task(3, 20, 1), task(4, 20, 1)};
  EXPECT_EQ(worst_response_time(tasks, 0), 7);
  EXPECT_EQ(worst_response_time(tasks, 1), 7);
}

TEST(WorstResponseTime, OfATaskThatIsReleasedOnce) {
  const Tasks tasks{{.execution = 5, .period = std::nullopt, .priority = 2}, task(4, 20, 1)};
  EXPECT_EQ(worst_response_time(tasks, 0), 5);
  EXPECT_EQ(worst_response_time(tasks, 1), 9);
}

TEST(WorstResponseTime, HasNoBoundWhereTheProcessorIsOverloaded) {
  const Tasks tasks{task(6, 10, 2), task(5, 10, 1), task(1, 1000, 3)};
  EXPECT_EQ(worst_response_time(tasks, 1), std::nullopt);
  EXPECT_EQ(worst_response_time(tasks, 0), 7) << "the more urgent ones are not concerned";
  EXPECT_EQ(worst_response_time(Tasks{task(1, 0, 1)}, 0), std::nullopt);
  EXPECT_EQ(
      worst_response_time(Tasks{task(1LL << 59, 1LL << 60, 2), task(1LL << 59, 1LL << 60, 1)}, 1),
      1LL << 60);
  const auto huge = 1LL << 61;
  EXPECT_EQ(worst_response_time(Tasks{task(huge, huge + 1, 2), task(huge, huge + 1, 1)}, 1),
            std::nullopt);
}

// Runs the tasks from a common release, tick by tick, until the processor idles; among equal
// priorities the task in question goes last. Nothing of it is shared with the formulas above.
std::int64_t simulated_worst(const Tasks& tasks, std::size_t watched) {
  struct Job {
    std::size_t task;
    std::int64_t release;
    std::int64_t left;
  };
  std::vector<Job> ready;
  std::int64_t worst = 0;
  for (std::int64_t now = 0;; ++now) {
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      if (now % *tasks[i].period == 0) ready.push_back({i, now, tasks[i].execution});
    }
    const auto best = std::ranges::max_element(ready, {}, [&](const Job& job) {
      return std::tuple(tasks[job.task].priority, job.task == watched ? 0 : 1, -job.release);
    });
    if (best == ready.end()) return worst;
    if (--best->left > 0) continue;
    if (best->task == watched) worst = std::max(worst, now + 1 - best->release);
    ready.erase(best);
    const bool is_busy = std::ranges::any_of(
        ready, [&](const Job& job) { return tasks[job.task].priority >= tasks[watched].priority; });
    if (!is_busy) return worst;
  }
}

TEST(WorstResponseTime, IsWhatASimulationOfTheCriticalInstantFinds) {
  std::mt19937 random(1);  // NOLINT: the same systems every time
  const auto up_to = [&random](std::int64_t limit) {
    return 1 + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(limit));
  };
  int compared = 0;
  while (compared < 3000) {
    Tasks tasks;
    double utilization = 0;
    for (auto count = up_to(5); count > 0; --count) {
      const auto period = 2 + up_to(38);
      const auto execution = up_to(std::max<std::int64_t>(period / 2, 1));
      tasks.push_back(task(execution, period, static_cast<std::int32_t>(up_to(4))));
      utilization += static_cast<double>(execution) / static_cast<double>(period);
    }
    if (utilization > 0.999) continue;
    ++compared;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      EXPECT_EQ(worst_response_time(tasks, i), simulated_worst(tasks, i))
          << "task " << i << " of system " << compared;
    }
  }
}

using Servers = std::vector<DeadlineServer>;

TEST(Demand, IsTheSumOfSharesRoundedUp) {
  EXPECT_EQ(demanded_ppb(Tasks{task(1, 3, 1), task(1, 4, 1)}), 333'333'334 + 250'000'000);
  FixedPriorityTask once;
  once.execution = 9;
  EXPECT_EQ(demanded_ppb({&once, 1}), 0) << "in the long run";
}

// A third three times over is all of it, not more, however it is rounded.
TEST(Demand, ExceedsAProcessorForCertain) {
  Tasks tasks(3, task(1, 3, 1));
  EXPECT_FALSE(demand_exceeds_processor(tasks));
  tasks.push_back(task(1, 1000, 1));
  EXPECT_TRUE(demand_exceeds_processor(tasks));
}

TEST(DeadlineServers, ReserveTheSumOfTheirShares) {
  EXPECT_EQ(reserved_ppb(Servers{{1, 4, 4}, {1, 2, 2}}), 750'000'000);
  EXPECT_EQ(reserved_ppb(Servers{{1, 3, 3}}), 333'333'334) << "rounded up";
  EXPECT_EQ(reserved_ppb({}), 0);
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(reserved_ppb(Servers{{kMost, 1, 1}, {kMost, 1, 1}}), kMost) << "forged";
}

TEST(DeadlineServers, OnOneProcessorMeetDeadlinesUpToFullUse) {
  EXPECT_TRUE(are_deadlines_guaranteed(Servers{{1, 2, 2}, {2, 4, 4}}, 1)) << "utilization 1";
  EXPECT_FALSE(are_deadlines_guaranteed(Servers{{1, 2, 2}, {3, 5, 5}}, 1)) << "1.1";
}

TEST(DeadlineServers, WithShortDeadlinesAreJudgedByTheirDemand) {
  // Densities 2/4 + 3/5 = 1.1 say nothing; demand at 4 is 2, at 5 is 5, at 12 (of 4 + 8) 7 …
  EXPECT_TRUE(are_deadlines_guaranteed(Servers{{2, 4, 8}, {3, 5, 10}}, 1));
  // At time 4 both must have run: 2 + 3 > 4.
  EXPECT_FALSE(are_deadlines_guaranteed(Servers{{2, 4, 8}, {3, 4, 10}}, 1));
}

TEST(DeadlineServers, OnSeveralProcessorsNeedRoomForTheLargest) {
  // Dhall: a whole processor and small change do not fit two processors under EDF.
  EXPECT_TRUE(
      are_deadlines_guaranteed(Servers{{1, 2, 2}, {1, 2, 2}, {1, 2, 2}}, 2));   // 1.5 <= 2 - .5
  EXPECT_FALSE(are_deadlines_guaranteed(Servers{{10, 10, 10}, {1, 9, 9}}, 2));  // 1.11 > 2 - 1
}

TEST(DeadlineServers, AtTheBoundOfTheTestAreGuaranteed) {
  EXPECT_TRUE(are_deadlines_guaranteed(Servers{{2, 3, 3}, {2, 3, 3}}, 2));  // 4/3 <= 2 - 2/3
  EXPECT_FALSE(
      are_deadlines_guaranteed(Servers{{2, 3, 3}, {2, 3, 3}, {1, 1'000'000, 1'000'000}}, 2));
  // Periods that no number of 64 bits is a multiple of.
  constexpr std::int64_t kPrime = 2'147'483'647;
  EXPECT_TRUE(are_deadlines_guaranteed(
      Servers{{1, 3, 3}, {1, kPrime, kPrime}, {1, kPrime - 18, kPrime - 18}}, 2));
}

TEST(DeadlineServers, OfNonsenseGuaranteeNothing) {
  EXPECT_FALSE(are_deadlines_guaranteed(Servers{{0, 1, 1}}, 1));
  EXPECT_FALSE(are_deadlines_guaranteed(Servers{{2, 1, 3}}, 1));
  EXPECT_FALSE(are_deadlines_guaranteed(Servers{{1, 2, 1}}, 1));
  EXPECT_TRUE(are_deadlines_guaranteed({}, 1));
}

TEST(DeadlineServers, ServeAJobByTheDeadlineOfItsLastBudget) {
  const DeadlineServer server{3, 8, 10};
  EXPECT_EQ(server_response_time(server, 3, 10), 8);
  EXPECT_EQ(server_response_time(server, 4, 20), 18);
  EXPECT_EQ(server_response_time(server, 4, 19), std::nullopt) << "two budgets take 20";
  EXPECT_EQ(server_response_time(server, 1, 9), std::nullopt) << "faster than its period";
}

// EDF tick by tick from a common release, which is the worst case on one processor.
bool simulated_edf(const Servers& servers) {
  struct Job {
    std::int64_t deadline;
    std::int64_t left;
  };
  std::int64_t hyperperiod = 1;
  for (const auto& server : servers)
    hyperperiod = std::lcm(hyperperiod, server.period);
  std::vector<Job> ready;
  for (std::int64_t now = 0; now < hyperperiod; ++now) {
    for (const auto& server : servers) {
      if (now % server.period == 0) ready.push_back({now + server.deadline, server.runtime});
    }
    const auto first = std::ranges::min_element(ready, {}, &Job::deadline);
    if (first == ready.end()) continue;
    if (first->deadline <= now) return false;
    if (--first->left == 0) ready.erase(first);
  }
  return ready.empty();
}

TEST(DeadlineServers, OnOneProcessorAreGuaranteedExactlyWhenASimulationMeetsEveryDeadline) {
  std::mt19937 random(2);  // NOLINT
  const auto up_to = [&random](std::int64_t limit) {
    return 1 + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(limit));
  };
  constexpr std::int64_t kPeriods[] = {4, 5, 6, 8, 10, 12, 15};
  int guaranteed = 0;
  for (int round = 0; round < 3000; ++round) {
    Servers servers;
    for (auto count = up_to(3); count > 0; --count) {
      const auto period = kPeriods[random() % 7];
      const auto runtime = up_to(period / 2);
      const auto deadline = std::min(period, runtime + up_to(period) - 1);
      servers.push_back({runtime, deadline, period});
    }
    const bool is_met = are_deadlines_guaranteed(servers, 1);
    EXPECT_EQ(is_met, simulated_edf(servers)) << round;
    guaranteed += is_met ? 1 : 0;
  }
  EXPECT_GT(guaranteed, 300);
  EXPECT_LT(guaranteed, 2700) << "both outcomes are exercised";
}

}  // namespace
}  // namespace cie::analysis
