// What it costs to bound response times: of n callbacks in n processes no more than grows with n
// squared, and near a utilization of 1, where busy periods are of any length, no more than a fixed
// effort.
#include "task_system.hpp"

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

std::int64_t used_cpu_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

// The least of several.
std::int64_t cost_of(const TaskSystem& system, const std::string& reason) {
  auto least = std::int64_t{1} << 62;
  for (int i = 0; i < 2; ++i) {
    const auto begin = used_cpu_time();
    const auto result = system.analyzed();
    least = std::min(least, used_cpu_time() - begin);
    EXPECT_THAT(result.callbacks.front().reason, testing::HasSubstr(reason));
  }
  return least;
}

// As many callbacks live all of the time, and as many processes with one callback each follow each
// other.
TaskSystem overloaded(std::int64_t count) {
  TaskSystem system;
  const TaskSystem::Parameters parameters{
      .execution = 9, .inter_arrival = 10, .response = 9, .priority = 50};
  const auto lasting = system.add_process(Timestamp{0}, Timestamp{10 * count});
  for (std::int64_t i = 0; i < count; ++i)
    system.add("lasting" + std::to_string(i), parameters).process = lasting;
  for (std::int64_t i = 0; i < count; ++i) {
    const auto process = system.add_process(Timestamp{10 * i}, Timestamp{10 * i + 5});
    system.add("short" + std::to_string(i), parameters).process = process;
    system.report.threads.back().process = process;
  }
  return system;
}

TEST(SchedulabilityGrowth, OfManyProcessesOnAnOverloadedCpu) {
  constexpr std::int64_t kFew = 40;
  constexpr std::int64_t kTimes = 8;
  const auto cost = [](std::int64_t count) { return cost_of(overloaded(count), "demand more"); };
  EXPECT_LE(cost(kTimes * kFew), cost(kFew) * kTimes * kTimes * 2);
}

// Each demands its part of the CPU less 1 ns in about 10 ms.
TaskSystem nearly_full(std::int64_t count) {
  TaskSystem system;
  for (std::int64_t i = 0; i < count; ++i) {
    const auto period = 10'000'000 + i * 7919;
    system.add("c" + std::to_string(i),
               {.execution = period / count - 1, .inter_arrival = period, .priority = 50});
  }
  return system;
}

TEST(SchedulabilityGrowth, OfManyCallbacksThatLeaveACpuNoTime) {
  const auto cost = [](std::int64_t count) {
    return cost_of(nearly_full(count), "for too long to compute");
  };
  EXPECT_LE(cost(120), cost(30) * 4);
}

}  // namespace
}  // namespace cie::analysis
