// What a recording lets know although an event stands at an awkward place in it.
#include <cie/analysis/analyzer.hpp>

#include "support/trace_text.hpp"

#include <optional>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

struct Instances : Observer {
  void on_instance(const Instance& instance) override {
    all.push_back(instance);
    Duration sum;
    for (const auto& by : instance.preempted_by)
      sum += by.time;
    by_others.push_back(sum.ns);
  }
  std::vector<Instance> all;
  std::vector<std::int64_t> by_others;
};

std::vector<std::int64_t> parts(const Instance& instance) {
  if (!instance.execution || !instance.blocked) return {};
  return {instance.execution->ns, instance.preempted->ns, instance.blocked->ns,
          instance.wake_delay->ns};
}

using Parts = std::vector<std::int64_t>;

// Streams are merged by time: of an event and a switch of the same nanosecond either may be first.
TEST(Knowable, PartsOfAnInstanceThatStartsInTheNanosecondOfItsSwitchIn) {
  const auto trace = test::trace_of(R"(
    callback fusion
    callback lidar
    2  switch 0 idle fusion
    4  preempt fusion by=lidar
    10 start  fusion release=9       # read before the switch
    10 resume fusion
    15 preempt fusion by=lidar
    18 resume fusion
    20 end    fusion
    30 switch 0 fusion idle)");
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(parts(told.all[0]), (Parts{5 + 2, 3, 0, 0}));
}

TEST(Knowable, WhoRanInsteadOfAnInstanceThatEndsInTheNanosecondOfItsSwitchIn) {
  const auto trace = test::trace_of(R"(
    callback fusion
    callback lidar
    8  switch 0 idle fusion
    10 start  fusion release=9
    15 preempt fusion by=lidar
    20 end    fusion                 # read before the switch
    20 resume fusion
    30 switch 0 fusion idle)");
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(parts(told.all[0]), (Parts{5, 5, 0, 0}));
  EXPECT_EQ(told.by_others, Parts{5});
}

// A thread that runs while the kernel's record begins does so until its first switch.
TEST(Knowable, PartsOfAnInstanceBeforeTheFirstSwitch) {
  const auto trace = test::trace_of(R"(
    callback fusion
    kernel
    10 start  fusion release=9
    20 end    fusion
    30 switch 0 fusion idle)");
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(parts(told.all[0]), (Parts{10, 0, 0, 0}));
}

// What woke a thread belongs to the instance that ended since, though its start is not recorded.
TEST(Knowable, AnEndWithoutItsStartUsesUpTheWakeUp) {
  auto trace = test::trace_of(R"(
    callback fusion waitable
    9  waking fusion
    10 wakeup fusion
    11 start  fusion release=none
    20 end    fusion
    21 start  fusion release=none    # was due already: the thread did not wait
    29 end    fusion)");
  trace.erase<CallbackStart>(
      [](const CallbackStart& start, const auto&) { return start.seq == 0; });
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(told.all[0].waking, std::nullopt);
  EXPECT_EQ(told.all[0].wakeup, std::nullopt);
  EXPECT_EQ(told.all[0].release_source, ReleaseSource::start);
}

// An announcement tells of a thread that has long begun.
TEST(Knowable, AnAnnouncementLeavesTheWakeUpAlone) {
  auto trace = test::trace_of(R"(
    process app attached
    callback fusion next=7
    9  waking fusion
    10 wakeup fusion
    12 begin  fusion
    13 audit  fusion
    15 start  fusion release=11
    20 end    fusion)");
  for (auto& event : trace.events) {
    if (auto* init = std::get_if<ThreadInit>(&event.body)) init->start_ns = -5'000;
  }
  Instances told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.all.size(), 1U);
  EXPECT_EQ(told.all[0].waking, Timestamp{9});
  EXPECT_EQ(told.all[0].wakeup, Timestamp{10});
}

}  // namespace
}  // namespace cie::analysis
