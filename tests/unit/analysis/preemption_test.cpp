// Who ran while a callback's instances were preempted, from the trace to the report.
#include <cie/analysis/analyzer.hpp>

#include "support/trace_text.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

// The preempted times of all measured instances, and what is said of who ran instead.
struct PreemptedTimes : Observer {
  void on_instance(const Instance& instance) override {
    if (!instance.preempted) return;
    Duration sum;
    for (const auto& by : instance.preempted_by)
      sum += by.time;
    preempted.push_back(instance.preempted->ns);
    told.push_back(sum.ns);
  }
  std::vector<std::int64_t> preempted;
  std::vector<std::int64_t> told;
};

using Times = std::vector<std::int64_t>;

TEST(Preemption, IsToldWithWhoRanInstead) {
  const auto trace = test::trace_of(R"(
    callback fusion
    callback lidar
    thread helper worker
    8  switch 0 idle fusion
    10 start  fusion release=9
    15 preempt fusion by=lidar
    18 resume fusion
    20 end    fusion
    30 start  fusion release=29
    32 preempt fusion by=helper
    39 resume fusion
    41 preempt fusion by=lidar
    42 resume fusion
    50 end    fusion
    60 switch 0 fusion idle)");
  PreemptedTimes told;
  const auto report = test::analyze(trace, {}, &told).report;
  EXPECT_EQ(told.preempted, (Times{3, 7 + 1}));
  EXPECT_EQ(told.told, told.preempted);
  std::vector<std::string> by;
  for (const auto& callback : report.callbacks) {
    if (!callback.preempted) continue;
    for (const auto& preemptor : callback.preempted_by) {
      by.push_back(preemptor.name + ' ' + std::to_string(preemptor.time.ns));
    }
  }
  EXPECT_EQ(by, (std::vector<std::string>{"helper 7", "lidar 4"})) << "longest first";
}

TEST(Preemption, IsToldOfEachOfManyThreads) {
  constexpr int kHelpers = 40;
  std::string text = "callback fusion\n";
  for (int i = 0; i < kHelpers; ++i)
    text += "thread helper" + std::to_string(i) + " worker\n";
  text += "8 switch 0 idle fusion\n10 start fusion release=9\n";
  std::int64_t preempted = 0;
  for (int i = 0; i < kHelpers; ++i) {
    const auto from = 100 * (i + 1);
    text += std::to_string(from) + " preempt fusion by=helper" + std::to_string(i) + '\n' +
            std::to_string(from + i + 1) + " resume fusion\n";
    preempted += i + 1;
  }
  const auto report =
      test::analyze(test::trace_of(text + "9000 end fusion\n9001 switch 0 fusion idle\n")).report;
  const auto& callback = report.callbacks.at(0);
  ASSERT_EQ(callback.preempted_by.size(), std::size_t{kHelpers});
  EXPECT_EQ(callback.preempted_by.front().time, Duration{kHelpers});
  EXPECT_EQ(callback.preempted_by.back().time, Duration{1});
  EXPECT_EQ(callback.preempted->sum, preempted);
}

}  // namespace
}  // namespace cie::analysis
