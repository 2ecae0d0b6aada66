// A timer of rclcpp as a callback: what it is released by.
#include <cie/scheduling/clock.hpp>

#include "distributions.hpp"
#include "support/rclcpp/tests/recorded_releases.hpp"
#include "support/rclcpp/tests/spinning.hpp"
#include "timer_callback.hpp"

#include <algorithm>

namespace cie_rclcpp {
namespace {

using namespace test;
using cie::scheduling::kNever;
using cie::scheduling::monotonic_now;

class TimerTest : public WithContext {
 protected:
  TimerTest() { forget_releases(); }
  std::unique_ptr<TimerCallback> callback(const rclcpp::TimerBase::SharedPtr& timer) {
    return std::make_unique<TimerCallback>(
        std::make_shared<cie::scheduling::GroupState>(cie::kNoNode,
                                                      cie::GroupType::mutually_exclusive),
        cie::trace::CallbackInfo{.logical_id = cie::trace::unique_logical_id("/t@Timer(x)")}, timer,
        open_admission(), [this] { ++gone_; });
  }
  static std::int64_t next_of(const rclcpp::TimerBase::SharedPtr& timer) {
    return timer->get_timer_handle()->next_call_time.load();
  }
  static void wait_until(std::int64_t due) {
    while (monotonic_now() <= due)
      std::this_thread::sleep_for(100us);
  }

  const rclcpp::Node::SharedPtr node_ = node("timing");
  int gone_ = 0;
  int runs_ = 0;
};

// The double keeps the instants that rcl only tells by a remaining time: exact but for one measurement,
// between whose two clocks the test may be kept waiting.
TEST_F(TimerTest, IsNotRunBeforeItIsDue) {
  const auto timer = node_->create_wall_timer(100s, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  for (int round = 0; round < 2; ++round) {
    std::int64_t due = kNever;
    for (int attempt = 0; attempt < 20; ++attempt)
      due = std::min(due, on_trial->next_due());
    EXPECT_GE(due, next_of(timer));
    EXPECT_LT(due, next_of(timer) + 4'000'000);
    EXPECT_FALSE(on_trial->execute_one());
    timer->reset();
  }
  EXPECT_EQ(runs_, 0);
}

TEST_F(TimerTest, IsReleasedByTheExpiryAndCountsWhatItMissed) {
  constexpr std::int64_t kFiftyMs = 50'000'000;
  const auto timer = node_->create_wall_timer(50ms, [this] { ++runs_; });
  const std::int64_t first = next_of(timer);
  const auto on_trial = callback(timer);
  wait_until(first);
  EXPECT_TRUE(on_trial->execute_one());
  const std::int64_t second = next_of(timer);
  wait_until(second + 3 * kFiftyMs);  // two or more go by
  EXPECT_TRUE(on_trial->execute_one());
  wait_until(next_of(timer));
  EXPECT_TRUE(on_trial->execute_one());
  EXPECT_EQ(runs_, 3);

  const auto releases = releases_of(on_trial->id());
  ASSERT_EQ(releases.size(), 3U);
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(releases[i].release_ns - releases[i - 1].release_ns,
              (1 + releases[i].missed) * kFiftyMs);
  }
  EXPECT_EQ(releases[2].kind, cie::ReleaseKind::timer);
  // What rcl goes on from after the third is a period later, if that was in time.
  EXPECT_NEAR(static_cast<double>(releases[2].release_ns),
              static_cast<double>(next_of(timer) - kFiftyMs), 1e6);
  EXPECT_GE(releases[1].missed, 2U);
}

TEST_F(TimerTest, AResetBeginsANewGrid) {
  constexpr std::int64_t kTwentyMs = 20'000'000;
  const auto timer = node_->create_wall_timer(20ms, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  wait_until(next_of(timer));
  EXPECT_TRUE(on_trial->execute_one());
  std::this_thread::sleep_for(7ms);
  timer->reset();
  const std::int64_t next = next_of(timer);
  wait_until(next);
  EXPECT_TRUE(on_trial->execute_one());
  const auto releases = releases_of(on_trial->id());
  ASSERT_EQ(releases.size(), 2U);
  // One that comes later still is released by the new grid's last expiry.
  const std::int64_t since = releases[1].release_ns - next;
  EXPECT_GT(since, -1'000'000);
  EXPECT_LT((since + 1'000'000) % kTwentyMs, 2'000'000);
  EXPECT_EQ(releases[1].missed, 0U);
}

// Twice the period, and called after one and a half: on the former grid that looks like a run in time that
// missed one.
TEST_F(TimerTest, IsNotSaidWhileItHasAnotherPeriodThanAtFirst) {
  constexpr std::int64_t kTwentyMs = 20'000'000;
  const auto timer = node_->create_wall_timer(20ms, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  wait_until(next_of(timer));
  EXPECT_TRUE(on_trial->execute_one());
  std::int64_t former = 0;
  rcl_timer_exchange_period(timer->get_timer_handle().get(), 2 * kTwentyMs, &former);
  wait_until(next_of(timer) + kTwentyMs * 3 / 2);
  EXPECT_TRUE(on_trial->execute_one());
  rcl_timer_exchange_period(timer->get_timer_handle().get(), kTwentyMs, &former);
  const std::int64_t next = next_of(timer);
  wait_until(next);
  EXPECT_TRUE(on_trial->execute_one());
  const auto releases = releases_of(on_trial->id());
  ASSERT_EQ(releases.size(), 3U);
  EXPECT_GT(releases[0].release_ns, 0);
  EXPECT_EQ(releases[1].release_ns, -1);
  EXPECT_EQ(releases[1].missed, 0U);
  EXPECT_GT(releases[2].release_ns, next - 1'000'000);
}

// Reset when it is due, to the nanosecond: the old grid has an expiry where it is due then, too.
TEST_F(TimerTest, AResetToTheOldGridMissesNothing) {
  constexpr std::int64_t kTwentyMs = 20'000'000;
  const auto timer = node_->create_wall_timer(20ms, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  wait_until(next_of(timer));
  EXPECT_TRUE(on_trial->execute_one());
  const std::int64_t due = next_of(timer) + kTwentyMs;
  const_cast<rcl_timer_t&>(*timer->get_timer_handle()).next_call_time.store(due);
  wait_until(due);
  EXPECT_TRUE(on_trial->execute_one());
  const auto releases = releases_of(on_trial->id());
  ASSERT_EQ(releases.size(), 2U);
  // None, but for what the test was kept waiting.
  EXPECT_EQ(releases[1].missed, (next_of(timer) - due) / kTwentyMs - 1);
}

// Since Iron its reset() tells.
TEST_F(TimerTest, ACancelledOneIsLookedAtOnceAPeriodWhereNobodyTellsOfItsReset) {
  const auto timer = node_->create_wall_timer(20ms, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  timer->cancel();
  const std::int64_t before = monotonic_now();
  const std::int64_t due = on_trial->next_due();
  if (tell_of_reset(*timer, [](std::size_t) {})) {
    EXPECT_EQ(due, kNever);
  } else {
    EXPECT_GE(due, before + 20'000'000);
    EXPECT_LE(due, monotonic_now() + 20'000'000);
  }
  wait_until(next_of(timer));
  EXPECT_FALSE(on_trial->execute_one());
  EXPECT_EQ(runs_, 0);
}

TEST_F(TimerTest, IsNeverDueOnceItWasDropped) {
  auto timer = node_->create_wall_timer(1ms, [this] { ++runs_; });
  const std::int64_t first = next_of(timer);
  const auto on_trial = callback(timer);
  timer.reset();
  wait_until(first);
  EXPECT_EQ(on_trial->next_due(), kNever);
  EXPECT_GE(gone_, 1);
  EXPECT_FALSE(on_trial->execute_one());
}

TEST_F(TimerTest, TellsThatItWent) {
  auto timer = node_->create_wall_timer(20ms, [] {});
  const auto on_trial = callback(timer);
  timer.reset();
  EXPECT_FALSE(on_trial->execute_one());
  EXPECT_GT(gone_, 0);
}

class Woken final : public cie::scheduling::ReadySink {
 public:
  void on_ready(cie::scheduling::Callback&) noexcept override { ++told; }
  std::atomic<int> told{0};
};

TEST_F(TimerTest, MissesNothingBeforeItIsServed) {
  const auto timer = node_->create_wall_timer(5ms, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  wait_until(next_of(timer) + 20'000'000);  // four more
  Woken sink;
  const std::int64_t began = monotonic_now();
  on_trial->serve(&sink);
  EXPECT_TRUE(on_trial->execute_one());
  const auto releases = releases_of(on_trial->id());
  ASSERT_EQ(releases.size(), 1U);
  // What the test was kept waiting between the two lines above may have been missed.
  EXPECT_LE(releases[0].missed, (monotonic_now() - began) / 5'000'000 + 1);
  on_trial->serve(nullptr);
}

// Simulated time: no instant of it is one of CLOCK_MONOTONIC; a step of it wakes the thread.
TEST_F(TimerTest, OfSimulatedTimeRunsWhenThatSaysAndItsReleaseIsNotSaid) {
  const auto clock = std::make_shared<rclcpp::Clock>(RCL_ROS_TIME);
  rcl_set_ros_time_override(clock->get_clock_handle(), 1'000'000'000);
  rcl_enable_ros_time_override(clock->get_clock_handle());
  const auto timer =
      rclcpp::create_timer(node_, clock, rclcpp::Duration{10ms}, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  EXPECT_EQ(on_trial->next_due(), kNever);
  Woken sink;
  on_trial->serve(&sink);
  rcl_set_ros_time_override(clock->get_clock_handle(), 1'005'000'000);
  EXPECT_EQ(sink.told, 1);
  EXPECT_FALSE(on_trial->execute_one());
  rcl_set_ros_time_override(clock->get_clock_handle(), 1'010'000'000);
  EXPECT_EQ(sink.told, 2);
  EXPECT_TRUE(on_trial->execute_one());
  const auto releases = releases_of(on_trial->id());
  ASSERT_EQ(releases.size(), 1U);
  EXPECT_EQ(releases[0].kind, cie::ReleaseKind::timer);
  EXPECT_EQ(releases[0].release_ns, -1);
  on_trial->serve(nullptr);
  rcl_set_ros_time_override(clock->get_clock_handle(), 1'020'000'000);
  EXPECT_EQ(sink.told, 2);
}

TEST_F(TimerTest, OfSystemTimeRunsAndItsReleaseIsNotSaid) {
  const auto clock = std::make_shared<rclcpp::Clock>(RCL_SYSTEM_TIME);
  const auto timer = rclcpp::create_timer(node_, clock, rclcpp::Duration{1ms}, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  EXPECT_LT(on_trial->next_due(), kNever);
  EXPECT_TRUE(comes([&] { return on_trial->execute_one(); }));
  EXPECT_EQ(releases_of(on_trial->id()).at(0).release_ns, -1);
}

// Without a period there is no expiry, and none that was missed.
TEST_F(TimerTest, OfNoPeriodRunsAndItsReleaseIsNotSaid) {
  const auto timer = node_->create_wall_timer(0ms, [this] { ++runs_; });
  const auto on_trial = callback(timer);
  Woken sink;
  on_trial->serve(&sink);
  for (std::size_t i = 0; i < 2; ++i) {
    std::this_thread::sleep_for(1ms);
    EXPECT_TRUE(on_trial->execute_one());
    EXPECT_EQ(releases_of(on_trial->id()).at(i).release_ns, -1);
    EXPECT_EQ(releases_of(on_trial->id()).at(i).missed, 0U);
  }
  on_trial->serve(nullptr);
}

}  // namespace
}  // namespace cie_rclcpp
