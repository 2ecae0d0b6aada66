#include <cie/scheduling/timer_schedule.hpp>

#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

constexpr std::int64_t kPeriod = 100;

TEST(TimerSchedule, IsNeverDueBeforeItIsStarted) {
  TimerSchedule schedule{kPeriod};
  EXPECT_EQ(schedule.next_due(), kNever);
  EXPECT_EQ(schedule.next_due(), kNever);
  EXPECT_FALSE(schedule.take(1'000'000));
}

TEST(TimerSchedule, GivesEachExpiryOnce) {
  TimerSchedule schedule{kPeriod};
  schedule.start_at(1000);
  EXPECT_FALSE(schedule.take(999));
  const auto release = schedule.take(1000);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->expiry_ns, 1000);
  EXPECT_EQ(release->missed, 0U);
  EXPECT_FALSE(schedule.take(1000));
  EXPECT_EQ(schedule.next_due(), 1100);
}

// A period of nanoseconds::max() is the usual way to say that there is none.
TEST(TimerSchedule, WhatLiesBeyondTheClockNeverExpires) {
  constexpr std::int64_t kNow = 1'000'000'000;
  EXPECT_EQ(later(kNow, kNever), kNever);
  EXPECT_EQ(later(kNow, kNever - kNow), kNever);
  EXPECT_EQ(later(kNow, -2 * kNow), 0);
  TimerSchedule schedule{kNever};
  schedule.start_at(kNow);
  ASSERT_TRUE(schedule.take(kNow));
  EXPECT_EQ(schedule.next_due(), kNever);
  EXPECT_FALSE(schedule.take(kNow + 1));
  schedule.start_on_grid(kNow - 1, kNow);
  EXPECT_EQ(schedule.next_due(), kNever);
}

// Being served late moves nothing: the grid is absolute.
TEST(TimerSchedule, DoesNotDrift) {
  TimerSchedule schedule{kPeriod};
  schedule.start_at(0);
  for (std::int64_t k = 0; k < 1000; ++k) {
    const auto release = schedule.take(k * kPeriod + 99);  // always 99 late
    ASSERT_TRUE(release);
    EXPECT_EQ(release->expiry_ns, k * kPeriod);
    EXPECT_EQ(release->missed, 0U);
  }
}

TEST(TimerSchedule, SkipsWholePeriodsAndCountsThem) {
  TimerSchedule schedule{kPeriod};
  schedule.start_at(0);
  ASSERT_TRUE(schedule.take(0));
  // 100, 200 and 300 are due; 100 and 200 are skipped.
  const auto release = schedule.take(399);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->expiry_ns, 300);
  EXPECT_EQ(release->missed, 2U);
  EXPECT_EQ(schedule.next_due(), 400);
}

// definitions.md: E(k+1) = E(k) + (1 + missed(k+1)) * T.
TEST(TimerSchedule, KeepsTheLawOfExpiries) {
  TimerSchedule schedule{kPeriod};
  schedule.start_at(7);
  std::int64_t previous = 7 - kPeriod;
  std::int64_t now = 7;
  for (const std::int64_t step : {0, 100, 1, 99, 250, 1000, 3, 101, 12345, 100}) {
    now += step;
    const auto release = schedule.take(now);
    if (!release) continue;
    EXPECT_EQ(release->expiry_ns, previous + (1 + std::int64_t{release->missed}) * kPeriod);
    EXPECT_LE(release->expiry_ns, now);
    EXPECT_GT(release->expiry_ns + kPeriod, now);
    previous = release->expiry_ns;
  }
}

TEST(TimerSchedule, StartsOnTheNextInstantOfItsGrid) {
  TimerSchedule schedule{kPeriod};
  schedule.start_on_grid(30, 30);
  EXPECT_EQ(schedule.next_due(), 30);
  schedule.start_on_grid(30, 31);
  EXPECT_EQ(schedule.next_due(), 130);
  schedule.start_on_grid(30, 1030);
  EXPECT_EQ(schedule.next_due(), 1030);
  schedule.start_on_grid(5000, 31);
  EXPECT_EQ(schedule.next_due(), 5000);
}

TEST(TimerSchedule, CountsAsManyPeriodsAsFitTheEvent) {
  TimerSchedule schedule{1};
  schedule.start_at(0);
  const auto release = schedule.take(std::int64_t{1} << 40);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->missed, 0xffffffffU);
  EXPECT_EQ(release->expiry_ns, std::int64_t{1} << 40);
}

// Threads of a reentrant group: every expiry goes to exactly one of them.
TEST(TimerSchedule, IsSharedByThreadsWithoutLossOrRepetition) {
  constexpr std::int64_t kExpiries = 20000;
  TimerSchedule schedule{1};
  schedule.start_at(0);
  std::atomic<std::int64_t> now{0};
  std::vector<std::vector<std::int64_t>> taken(3);
  std::vector<std::thread> threads;
  for (auto& mine : taken) {
    threads.emplace_back([&schedule, &now, &mine] {
      for (std::int64_t t = 0; t < kExpiries; t = now.fetch_add(1)) {
        if (const auto release = schedule.take(t)) {
          for (std::int64_t i = 0; i <= std::int64_t{release->missed}; ++i) {
            mine.push_back(release->expiry_ns - i);
          }
        }
      }
    });
  }
  for (auto& thread : threads)
    thread.join();
  std::set<std::int64_t> all;
  std::size_t count = 0;
  for (const auto& mine : taken) {
    all.insert(mine.begin(), mine.end());
    count += mine.size();
  }
  EXPECT_EQ(count, all.size());
  EXPECT_EQ(all.size(), static_cast<std::size_t>(*all.rbegin()) + 1);
}

TEST(TimerSchedule, StartedAnewCountsNoMissedExpiryOfTheOldGrid) {
  TimerSchedule schedule{10};
  schedule.start_at(100);
  schedule.start_at(kNever);
  EXPECT_FALSE(schedule.take(1000));
  schedule.start_at(1007);
  const auto release = schedule.take(1007);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->expiry_ns, 1007);
  EXPECT_EQ(release->missed, 0U);
  EXPECT_EQ(schedule.next_due(), 1017);
}

TEST(TimerSchedule, ExpiresOnceHoweverLate) {
  TimerSchedule schedule{10};
  schedule.start_at(100);
  EXPECT_FALSE(schedule.take_last(99));
  const auto release = schedule.take_last(175);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->expiry_ns, 100);
  EXPECT_EQ(release->missed, 0U);
  EXPECT_EQ(schedule.next_due(), kNever);
  EXPECT_FALSE(schedule.take_last(1000));
}

}  // namespace
}  // namespace cie::scheduling
