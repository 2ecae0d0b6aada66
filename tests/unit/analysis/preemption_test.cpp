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

}  // namespace
}  // namespace cie::analysis
