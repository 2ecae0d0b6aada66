// A reset of a timer, which no event tells, while its thread has other things to do all the time: late
// starts have a reason then, and fit the grid as it was.
#include "ros2_text.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::ReleaseSource;
using analysis::Verdict;

constexpr std::int64_t kMicrosecond = 1'000;
constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kEvery = 10 * kMillisecond;
constexpr int kPromptStarts = 8;
constexpr int kLateStarts = 12;
constexpr auto kHeldUp = "/n@Timer(10000000)";

// Some prompt starts; then another callback holds up each one by 3 ms, of a grid that moved by so
// much; then, where it did not, perhaps a prompt start again. All instances take 1 ms.
// `timers`: as many of the same period, one after the other in it.
std::string held_up(std::int64_t moved, bool ends_promptly, int late_starts = kLateStarts,
                    int timers = 1) {
  std::string text =
      "0 rcl_init context_handle=0x1\n0 rcl_node_init node_handle=0x10 node_name=n namespace=/\n";
  const auto address = [](int begin, int timer) { return std::to_string(begin + 0x100 * timer); };
  for (int timer = 0; timer < timers; ++timer) {
    const auto handle = " timer_handle=" + address(0x20, timer);
    text += "0 rcl_timer_init" + handle + " period=10000000\n" + "0 rclcpp_timer_callback_added" +
            handle + " callback=" + address(0x30, timer) + '\n' + "0 rclcpp_timer_link_node" +
            handle + " node_handle=0x10\n";
  }
  const auto run = [&text](const std::string& callback, std::int64_t start, std::int64_t end) {
    text += std::to_string(start) + " callback_start callback=" + callback + '\n' +
            std::to_string(end) + " callback_end callback=" + callback + '\n';
  };
  const auto expiry = [](int k) { return k * kEvery - 10 * kMicrosecond; };
  for (int k = 1; k <= kPromptStarts + late_starts + (ends_promptly ? 1 : 0); ++k) {
    const bool is_late = k > kPromptStarts && k <= kPromptStarts + late_starts;
    const auto start = expiry(k) + (is_late ? moved + 3 * kMillisecond : 100 * kMicrosecond);
    if (is_late) run("0x70", expiry(k) - 2 * kMillisecond, start - kMicrosecond);
    for (int timer = 0; timer < timers; ++timer) {
      const auto from = start + timer * 2 * kMicrosecond;
      run(address(0x30, timer), from, from + (timers == 1 ? kMillisecond : kMicrosecond));
    }
  }
  return text;
}

TEST(Ros2TimerResets, LateStartsThatNoPromptOneFollowsAreBounds) {
  const auto result = analyze_ros2(held_up(4 * kMillisecond, false));
  const auto& timer = result.callback(kHeldUp);
  EXPECT_EQ(timer.release_source, ReleaseSource::mixed);
  ASSERT_TRUE(timer.response_time);
  EXPECT_EQ(timer.response_time->count, kPromptStarts);
  EXPECT_EQ(timer.response_time->max, 1'100 * kMicrosecond);
  EXPECT_EQ(timer.start_latency->count, kPromptStarts);
  EXPECT_EQ(timer.inter_arrival->count, kPromptStarts - 1);
  ASSERT_TRUE(timer.response_time_lower);
  EXPECT_EQ(timer.response_time_lower->count, kLateStarts);
  EXPECT_EQ(timer.response_time_lower->max, kMillisecond);
  EXPECT_FALSE(timer.response_time_upper);
  EXPECT_FALSE(timer.missed_releases);
  for (const auto* rule : {"R1", "R2"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
}

TEST(Ros2TimerResets, APromptStartProvesLateOnesBeforeIt) {
  const auto result = analyze_ros2(held_up(0, true));
  const auto& timer = result.callback(kHeldUp);
  EXPECT_EQ(timer.release_source, ReleaseSource::timer_grid);
  EXPECT_EQ(timer.response_time->count, kPromptStarts + kLateStarts + 1);
  EXPECT_EQ(timer.response_time->max, 4 * kMillisecond);
  EXPECT_EQ(timer.inter_arrival->count, kPromptStarts + kLateStarts);
  EXPECT_FALSE(timer.response_time_lower);
  EXPECT_EQ(timer.missed_releases, 0U);
}

std::vector<std::int64_t> releases_of_rows(const Ros2Result& result) {
  std::vector<std::int64_t> releases;
  for (const auto& row : result.instances) {
    if (row.logical_id == kHeldUp) releases.push_back(row.release);
  }
  return releases;
}

TEST(Ros2TimerResets, RowsTellNoReleaseThatNothingProves) {
  const auto releases = releases_of_rows(analyze_ros2(held_up(4 * kMillisecond, false)));
  ASSERT_EQ(releases.size(), kPromptStarts + kLateStarts);
  for (int k = 1; k <= kPromptStarts + kLateStarts; ++k) {
    const auto proven = k <= kPromptStarts ? k * kEvery - 10 * kMicrosecond : -1;
    EXPECT_EQ(releases[static_cast<std::size_t>(k - 1)], proven) << k;
  }
}

TEST(Ros2TimerResets, RowsTellReleasesThatAPromptStartProvesLater) {
  const auto releases = releases_of_rows(analyze_ros2(held_up(0, true)));
  ASSERT_EQ(releases.size(), kPromptStarts + kLateStarts + 1);
  for (int k = 1; k <= kPromptStarts + kLateStarts + 1; ++k)
    EXPECT_EQ(releases[static_cast<std::size_t>(k - 1)], k * kEvery - 10 * kMicrosecond) << k;
}

// More than are waited for: the first are told by bounds, the others are proven.
TEST(Ros2TimerResets, RowsAreHeldBackInBoundedMemory) {
  constexpr int kMost = 4096;
  constexpr int kLate = kMost + 500;
  const auto releases = releases_of_rows(analyze_ros2(held_up(0, true, kLate)));
  ASSERT_EQ(releases.size(), kPromptStarts + kLate + 1);
  EXPECT_EQ(std::ranges::count(releases, -1), kMost);
  EXPECT_EQ(releases[kPromptStarts + kMost],
            (kPromptStarts + kMost + 1) * kEvery - 10 * kMicrosecond);
}

// Of many timers fewer are waited for.
TEST(Ros2TimerResets, RowsOfManyTimersAreHeldBackInBoundedMemory) {
  constexpr int kMostOfAll = 65'536;
  constexpr int kTimers = 20;
  constexpr int kLate = 4000;
  const auto result = analyze_ros2(held_up(0, true, kLate, kTimers));
  const auto proven = std::ranges::count_if(result.instances, [](const auto& row) {
    return row.logical_id.starts_with(kHeldUp) && row.release >= 0;
  });
  EXPECT_GT(proven, kMostOfAll / 2);
  EXPECT_LT(proven, kTimers * kLate) << "one timer at least did not wait";
}

// Its deadline is missed only by what is proven.
TEST(Ros2TimerResets, OnlyProvenReleasesMakeInstancesLate) {
  const auto late = [](std::int64_t moved, bool ends_promptly) {
    return analyze_ros2(
               held_up(moved, ends_promptly), -1,
               "callback_groups:\n  - {id: \"/n@Timer(10000000)\", response_deadline: 2ms}\n")
        .callback(kHeldUp)
        .late;
  };
  EXPECT_EQ(late(4 * kMillisecond, false), 0U);
  EXPECT_EQ(late(0, true), static_cast<std::uint64_t>(kLateStarts));
}

// Expiry 9 ends with a reset, 300 us behind expiry 11; what runs then ends 420 us before the next one of
// the new grid. The executor waits for that: nothing was due before, as expiry 10 would have been.
std::string reset_before_a_wait(std::int64_t waits) {
  std::string text = held_up(0, false, 0);
  const auto at = [&text](std::int64_t time, const std::string& event) {
    text += std::to_string(time) + ' ' + event + '\n';
  };
  const auto expiry = [](int k) { return k * kEvery - 10 * kMicrosecond; };
  const auto reset = expiry(11) + 300 * kMicrosecond;
  at(expiry(9) + 60 * kMicrosecond, "callback_start callback=48");
  at(reset, "callback_end callback=48");
  at(reset + 10 * kMicrosecond, "callback_start callback=0x70");
  const auto start = reset + kEvery + 75 * kMicrosecond;
  at(start - 15 * kMicrosecond - waits, "callback_end callback=0x70");
  at(start - 10 * kMicrosecond - waits, "rclcpp_executor_wait_for_work timeout=-1");
  at(start - 10 * kMicrosecond, "rclcpp_executor_get_next_ready");
  for (int k = 0; k < kPromptStarts; ++k) {
    at(start + k * kEvery, "callback_start callback=48");
    at(start + k * kEvery + kMillisecond, "callback_end callback=48");
  }
  return text;
}

TEST(Ros2TimerResets, AStartAfterAWaitWasNotDueBeforeIt) {
  const auto result = analyze_ros2(reset_before_a_wait(400 * kMicrosecond));
  const auto& timer = result.callback(kHeldUp);
  EXPECT_EQ(timer.response_time->max, 20 * kMillisecond + 300 * kMicrosecond)
      << "of the instance that resets";
  EXPECT_FALSE(timer.missed_releases);
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive) << result.evidence("R2");
}

// Where it found work at once, expiry 10 may have been it, and 11 and 12 were skipped then.
TEST(Ros2TimerResets, AStartAfterALookMayHaveBeenDueBeforeIt) {
  const auto result = analyze_ros2(reset_before_a_wait(0));
  EXPECT_EQ(result.callback(kHeldUp).missed_releases, 2U);
}

}  // namespace
}  // namespace cie::test
