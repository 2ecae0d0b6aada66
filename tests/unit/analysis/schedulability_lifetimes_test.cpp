// What lived at different times, in one process or in several, disturbs nothing of the other's.
#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/schedulability.hpp>

#include "task_system.hpp"

#include <cstdint>
#include <optional>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using ::testing::HasSubstr;

// The application ran twice, one run after the other.
TEST(SchedulabilityOfLifetimes, CountsNothingThatEndedBefore) {
  auto system = textbook();
  system.add_process({0}, {99});
  system.add_process({100}, {199});
  system.report.callbacks[0].process = system.report.threads[0].process = ProcessIndex{1};
  auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[2].bound_ns, 5 + 3);
  EXPECT_EQ(result.cpus.at(0).real_time_ppb, 250'000'000 + 250'000'000);
  system.report.processes[1].lived.from = {99};
  result = system.analyzed();
  EXPECT_EQ(result.callbacks[2].bound_ns, 20);
  EXPECT_EQ(result.cpus.at(0).real_time_ppb, 928'571'429);
}

// Three lifetimes of one rival, which take 3/7 each, and never two of them at a time.
TEST(SchedulabilityOfLifetimes, TakesNoSumOverLifetimesForAnOverload) {
  auto system = textbook();
  system.add_process({0}, {900});  // lives on
  for (const std::int64_t from : {100, 200}) {
    auto& again = system.add("high", {.execution = 3, .inter_arrival = 7, .priority = 30});
    again.process = system.report.threads.back().process = system.add_process({from}, {from + 99});
  }
  system.report.callbacks[0].process = system.report.threads[0].process =
      system.add_process({0}, {99});
  const auto result = system.analyzed("callback_groups:\n  - {id: low, response_deadline: 20}\n");
  EXPECT_EQ(result.cpus.at(0).real_time_ppb, 928'571'429);
  EXPECT_EQ(result.callbacks[2].bound_ns, std::nullopt);
  EXPECT_EQ(result.callbacks[2].meets_deadline(), std::nullopt);
  EXPECT_THAT(result.callbacks[2].reason, HasSubstr("though no two of some lived at once"));
}

// As a timer that its process makes anew: "low" lives through all of it, "mid" beside the second alone.
TEST(SchedulabilityOfLifetimes, CountsLifetimesWithinOneProcess) {
  auto system = textbook();
  system.report.callbacks[0].lived = {{0}, {99}};
  system.add("high", {.execution = 3, .inter_arrival = 7, .priority = 30}).lived = {{100}, {199}};
  system.report.callbacks[1].lived = {{150}, {199}};
  system.report.callbacks[2].lived = {{0}, {99}};
  const auto result = system.analyzed();
  EXPECT_EQ(result.callbacks[1].bound_ns, 3 + 3);
  EXPECT_EQ(result.callbacks[2].bound_ns, 5 + 2 * 3) << "of what lived then: R = 5 + ceil(11/7) 3";
  EXPECT_EQ(result.callbacks[3].bound_ns, 3) << "no rival of the first";
  EXPECT_EQ(result.cpus.at(0).real_time_ppb, 428'571'429 + 250'000'000) << "3/7 + 3/12, or + 5/20";
}

// The three at 100 are the most that live at once: 3/7 + 3/12 + 5/20.
TEST(SchedulabilityOfLifetimes, AddsUpTheDemandOfWhatLivesAtTheSameTime) {
  auto system = textbook();
  for (const auto& [callback, from, to] :
       {std::tuple{0U, 0, 200}, std::tuple{1U, 50, 100}, std::tuple{2U, 100, 300}}) {
    system.report.callbacks[callback].process = system.report.threads[callback].process =
        system.add_process({from}, {to});
  }
  EXPECT_EQ(system.analyzed().cpus.at(0).real_time_ppb, 928'571'429);
  system.report.processes[2].lived.from = {101};
  EXPECT_EQ(system.analyzed().cpus.at(0).real_time_ppb, 428'571'429 + 250'000'000);
}

}  // namespace
}  // namespace cie::analysis
