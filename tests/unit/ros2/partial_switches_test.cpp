// S1 to S4 of recordings that read no parameters back, where the kernel's record is not whole.
#include "ros2_text.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::TimeWindow;
using analysis::Verdict;
using testing::HasSubstr;

// SCHED_FIFO 20 is the kernel's priority 79.
constexpr const char* kFifo20 =
    "callback_groups:\n"
    "  - id: /n@Timer(1)\n"
    "    affinity: [0, 1]\n"
    "    policy: SCHED_FIFO\n"
    "    priority: 20\n";

// Of a window behind the first instance nobody can tell how that began.
TEST(BeforeTheFirstInstance, IsNotAskedForWhereThatLiesBeforeTheWindow) {
  const TimeWindow later{.from = {15}, .to = {40}};
  const TimeWindow whole{.from = {5}, .to = {40}};
  const auto good = kTwoTimers + instance(10, 79) + instance(20, 120) + instance(30, 79);
  EXPECT_EQ(analyze_ros2(good, -1, kFifo20).verdict("S2"), Verdict::pass);
  EXPECT_EQ(analyze_ros2(good, -1, kFifo20, later).verdict("S2"), Verdict::not_applicable);
  const auto bad = kTwoTimers + instance(10, 120) + instance(20, 79) + instance(30, 79);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20).verdict("S2"), Verdict::fail);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20, later).verdict("S2"), Verdict::not_applicable);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20, whole).verdict("S2"), Verdict::fail);
}

}  // namespace
}  // namespace cie::test
