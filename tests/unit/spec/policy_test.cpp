#include <cie/tracepoints/policy.hpp>

#include <gtest/gtest.h>

namespace cie {
namespace {

TEST(Policy, OfLinuxHasANiceValueOrAPriorityOrADeadline) {
  for (const auto policy : {Policy::other, Policy::batch}) {
    EXPECT_TRUE(has_nice(policy));
    EXPECT_FALSE(has_priority(policy));
    EXPECT_FALSE(is_real_time(policy));
  }
  for (const auto policy : {Policy::fifo, Policy::round_robin}) {
    EXPECT_FALSE(has_nice(policy));
    EXPECT_TRUE(has_priority(policy));
    EXPECT_TRUE(is_real_time(policy));
  }
  for (const auto policy : {Policy::idle, Policy::deadline}) {
    EXPECT_FALSE(has_nice(policy));
    EXPECT_FALSE(has_priority(policy));
  }
  EXPECT_FALSE(is_real_time(Policy::idle));
  EXPECT_TRUE(is_real_time(Policy::deadline));
}

TEST(Policy, GivesThePriorityThatTheKernelTells) {
  EXPECT_EQ(kernel_priority(Policy::fifo, 0, 80), 99 - 80);
  EXPECT_EQ(kernel_priority(Policy::round_robin, 0, 1), 99 - 1);
  EXPECT_EQ(kernel_priority(Policy::other, -5, 0), 120 - 5);
  EXPECT_EQ(kernel_priority(Policy::batch, 19, 0), 120 + 19);
  EXPECT_EQ(kernel_priority(Policy::idle, 0, 0), 120);
  EXPECT_EQ(kernel_priority(Policy::deadline, 0, 0), -1);
  EXPECT_EQ(kernel_priority(Policy{7}, 0, 0), 120) << "a policy that is not known";
  EXPECT_EQ(kernel_priority(Policy{7}, 5, 0), 120 + 5) << "SCHED_EXT has a nice value";
}

TEST(Policy, TakesNoMoreThanAPriorityCanBe) {
  EXPECT_EQ(kernel_priority(Policy::fifo, 0, 4'000'000'000), 0);
  EXPECT_EQ(kernel_priority(Policy::other, -100, 0), 100);
}

}  // namespace
}  // namespace cie
