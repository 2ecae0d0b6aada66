#include "thread_timeline.hpp"

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

constexpr HostIndex kHost{};
constexpr std::int64_t kThread = 100;
constexpr std::int64_t kOther = 200;
constexpr std::int64_t kIdle = 0;
constexpr std::int64_t kSleeping = 1;
constexpr std::int64_t kRunnable = 0x100;  // "preempted"

// One CPU on which threads follow one another.
class OneCpu : public testing::Test {
 protected:
  void switch_to(std::int64_t time, std::int64_t next, std::int64_t prev_state) {
    SchedSwitch event;
    event.prev_tid = current_;
    event.prev_state = prev_state;
    event.next_tid = next;
    hole_ = timeline_.on_switch(kHost, 0, Timestamp{time}, event, nullptr);
    current_ = next;
  }
  ThreadTimeline::Mark mark(std::int64_t time) {
    return timeline_.mark(kHost, kThread, Timestamp{time});
  }

  ThreadTimeline timeline_;
  std::int64_t current_ = kIdle;
  std::optional<ThreadTimeline::Hole> hole_;
};

TEST_F(OneCpu, SplitsADurationIntoItsFourParts) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(12);
  switch_to(20, kOther, kRunnable);                             // 8 executed
  switch_to(25, kThread, kRunnable);                            // 5 preempted
  switch_to(30, kIdle, kSleeping);                              // 5 executed
  timeline_.on_waking(kHost, kThread, Timestamp{37});           // 7 blocked
  switch_to(41, kThread, kRunnable);                            // 4 wake delay
  const auto parts = ThreadTimeline::between(start, mark(50));  // 9 executed
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 8 + 5 + 9);
  EXPECT_EQ(parts->preempted.ns, 5);
  EXPECT_EQ(parts->blocked->ns, 7);
  EXPECT_EQ(parts->wake_delay->ns, 4);
  EXPECT_EQ((parts->execution + parts->preempted + *parts->blocked + *parts->wake_delay).ns,
            50 - 12);
}

TEST_F(OneCpu, FallsBackToWakeupWhereThereIsNoWaking) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(10);
  switch_to(20, kIdle, kSleeping);
  timeline_.on_wakeup(kHost, kThread, Timestamp{26});
  switch_to(30, kThread, kRunnable);
  const auto parts = ThreadTimeline::between(start, mark(30));
  EXPECT_EQ(parts->blocked->ns, 6);
  EXPECT_EQ(parts->wake_delay->ns, 4);
}

TEST_F(OneCpu, WithoutAnyWakeUpTheSplitOfBlockedIsUnknownButExecutionIsNot) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(10);
  switch_to(20, kIdle, kSleeping);
  switch_to(30, kThread, kRunnable);
  const auto parts = ThreadTimeline::between(start, mark(35));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 15);
  EXPECT_FALSE(parts->blocked.has_value());
  EXPECT_FALSE(parts->wake_delay.has_value());
}

TEST_F(OneCpu, AMissingSwitchBreaksTheRecordOfItsThread) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(12);
  current_ = kOther;  // somebody ran in between, unrecorded
  switch_to(30, kThread, kRunnable);
  ASSERT_TRUE(hole_.has_value());
  EXPECT_EQ(hole_->begin.ns, 10);
  EXPECT_EQ(hole_->end.ns, 30);
  EXPECT_FALSE(ThreadTimeline::between(start, mark(40)).has_value());
  EXPECT_TRUE(timeline_.overlaps_hole(kHost, Timestamp{29}, Timestamp{50}));
  EXPECT_FALSE(timeline_.overlaps_hole(kHost, Timestamp{31}, Timestamp{50}));
}

TEST_F(OneCpu, AUserEventProvesThatItsThreadRuns) {
  switch_to(5, kOther, kRunnable);
  timeline_.on_user_event(kHost, kThread, 0, Timestamp{10});  // kernel record begins too late
  const auto start = mark(10);
  const auto parts = ThreadTimeline::between(start, mark(18));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 8);
}

TEST_F(OneCpu, AUserEventInTheNanosecondOfTheSwitchOutBelongsBeforeIt) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(10);
  switch_to(20, kIdle, kSleeping);
  timeline_.on_user_event(kHost, kThread, 0, Timestamp{20});
  timeline_.on_waking(kHost, kThread, Timestamp{25});
  switch_to(30, kThread, kRunnable);
  const auto parts = ThreadTimeline::between(start, mark(30));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 10);
  EXPECT_EQ(parts->blocked->ns, 5);
}

TEST_F(OneCpu, RemembersTheLastWakingAndTheSwitchInThatFollowed) {
  timeline_.on_waking(kHost, kThread, Timestamp{3});
  timeline_.on_waking(kHost, kThread, Timestamp{7});
  switch_to(11, kThread, kRunnable);
  const auto wake = timeline_.last_wake(kHost, kThread);
  EXPECT_EQ(wake.waking->ns, 7);
  EXPECT_EQ(wake.first_in->ns, 11);
  timeline_.forget_wake(kHost, kThread);
  EXPECT_FALSE(timeline_.last_wake(kHost, kThread).waking.has_value());
}

TEST_F(OneCpu, IsConfirmedOnceEveryCpuWasHeardOf) {
  switch_to(10, kThread, kRunnable);
  EXPECT_TRUE(timeline_.is_confirmed(kHost, Timestamp{10}));
  EXPECT_FALSE(timeline_.is_confirmed(kHost, Timestamp{11}));
}

}  // namespace
}  // namespace cie::analysis
