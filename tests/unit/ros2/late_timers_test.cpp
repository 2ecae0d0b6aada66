// Starts of a timer's callback long after its release, and what tells the reason: then the release is known
// all the same, once a start at once has shown that nobody reset the timer.
#include "timer_text.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test::timers {
namespace {

using analysis::Verdict;
using testing::ElementsAre;

constexpr std::int64_t kUnknown = -1;
// An instance begins at expiry 1 and overruns two periods. The next call is of expiry 2, the one after
// that of expiry 4.
constexpr std::int64_t kOverrun = 23 * kMs;
constexpr auto kEnd = expiry(1) + 100 * kUs + kOverrun;

std::string on(const std::string& event, int tid) { return event + " tid=" + std::to_string(tid); }

std::string switch_of(int prev, int prev_state, int next) {
  return "sched:sched_switch prev_tid=" + std::to_string(prev) +
         " prev_prio=120 prev_state=" + std::to_string(prev_state) +
         " next_tid=" + std::to_string(next) + " next_prio=120";
}

// The start after the overrun comes so long after its end.
Text& start_after(Text& text, std::int64_t look, int tid = 1) {
  text.add(kEnd + look - 1, on("rclcpp_executor_get_next_ready", tid));
  text.add(kEnd + look, on("callback_start callback=0x30", tid));
  return text.add(kEnd + look + kMs, on("callback_end callback=0x30", tid));
}

Text& prompt_start(Text& text, std::int64_t k) { return text.run(expiry(k) + 100 * kUs); }

Text overrun() {
  Text text;
  text.run(expiry(1) + 100 * kUs, kOverrun);
  return text;
}

// The same of a thread that the kernel's events show: it has CPU 0 from the beginning.
Text overrun_on_cpu() {
  Text text;
  text.add(kMade + 1, switch_of(0, 0, 1));
  text.run(expiry(1) + 100 * kUs, kOverrun);
  text.add(kEnd + 10 * kUs, "rclcpp_executor_wait_for_work timeout=1");
  return text;
}

TEST(Ros2LateTimers, AnExecutorThatLooksForLongHasNotWaitedIfTheKernelShowsThat) {
  auto text = overrun_on_cpu();
  prompt_start(start_after(text, 300 * kUs), 4);
  const auto result = text.analyze();
  EXPECT_THAT(releases(result), ElementsAre(expiry(1), expiry(2), expiry(4)));
  EXPECT_EQ(result.callback(kId).missed_releases, 1U);
  EXPECT_EQ(result.verdict("R2"), Verdict::fail);
}

// Nor has one that sleeps for a moment and then waits for a CPU, be it for milliseconds.
TEST(Ros2LateTimers, AWaitForACpuIsNoWaitForWork) {
  auto text = overrun_on_cpu();
  text.add(kEnd + 20 * kUs, switch_of(1, 1, 0));
  text.add(kEnd + 60 * kUs, "sched:sched_waking tid=1 prio=120 target_cpu=0");
  text.add(kEnd + 3'600 * kUs, switch_of(0, 0, 1));
  prompt_start(start_after(text, 3'700 * kUs), 4);
  EXPECT_THAT(releases(text.analyze()), ElementsAre(expiry(1), expiry(2), expiry(4)));
}

// It slept until something was due: that came after the overrun.
TEST(Ros2LateTimers, WhatAThreadSleepsForWasNotDueBefore) {
  auto text = overrun_on_cpu();
  text.add(kEnd + 20 * kUs, switch_of(1, 1, 0));
  text.add(kEnd + 250 * kUs, "sched:sched_waking tid=1 prio=120 target_cpu=0");
  text.add(kEnd + 260 * kUs, switch_of(0, 0, 1));
  prompt_start(start_after(text, 300 * kUs), 4);
  EXPECT_THAT(releases(text.analyze()), ElementsAre(expiry(1), kUnknown, expiry(4)));
}

TEST(Ros2LateTimers, WithoutTheKernelsEventsALongLookMayBeAWait) {
  auto text = overrun();
  text.add(kEnd + 10 * kUs, "rclcpp_executor_wait_for_work timeout=1");
  prompt_start(start_after(text, 300 * kUs), 4);
  EXPECT_THAT(releases(text.analyze()), ElementsAre(expiry(1), kUnknown, expiry(4)));
}

// Of a mutually exclusive group, whose timer nobody waits for while it runs.
TEST(Ros2LateTimers, OtherThreadsWaitForTheTimersOwnInstance) {
  for (const bool is_woken_at_once : {true, false}) {
    Text text;
    // Thread 2 has nothing to do from before the overrun on.
    text.add(expiry(1), on("callback_start callback=0x70", 2));
    text.add(expiry(1) + 1, on("callback_end callback=0x70", 2));
    text.add(expiry(1) + 2, on("rclcpp_executor_wait_for_work timeout=1", 2));
    text.run(expiry(1) + 100 * kUs, kOverrun);
    start_after(text, is_woken_at_once ? 60 * kUs : 400 * kUs, 2);
    prompt_start(text, 4);
    EXPECT_THAT(
        releases(text.analyze()),
        ElementsAre(kUnknown, expiry(1), is_woken_at_once ? expiry(2) : kUnknown, expiry(4)));
  }
}

// The executor had found it in time.
TEST(Ros2LateTimers, WhatWasFoundInTimeMayHaveWaitedForACpu) {
  for (const bool is_in_time : {true, false}) {
    Text text;
    prompt_start(text, 1);
    text.add(expiry(1) + 2 * kMs, "rclcpp_executor_wait_for_work timeout=1");
    text.add(expiry(2) + (is_in_time ? 50 : 2'800) * kUs, "rclcpp_executor_get_next_ready");
    text.run_next(expiry(2) + 2'840 * kUs);
    prompt_start(text, 3);
    EXPECT_THAT(releases(text.analyze()),
                ElementsAre(expiry(1), is_in_time ? expiry(2) : kUnknown, expiry(3)));
  }
}

// Timers of executors that oversleep are late for no reason that events tell. A timer that was reset starts
// promptly by its old grid no more.
TEST(Ros2LateTimers, AGridHoldsAsLongAsMostStartsWithoutAReasonToBeLateArePrompt) {
  for (const int late : {10, 11}) {
    Text text;
    for (int k = 1; k <= 10 + late; ++k)
      text.run(expiry(k) + (k % 2 == 0 || k > 20 ? 4 * kMs : 100 * kUs));
    const auto result = text.analyze();
    EXPECT_EQ(result.callback(kId).response_time.has_value(), late == 10);
  }
}

}  // namespace
}  // namespace cie::test::timers
