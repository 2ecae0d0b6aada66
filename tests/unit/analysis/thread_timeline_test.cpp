#include "trackers/thread_timeline.hpp"

#include <cie/analysis/instance.hpp>

#include <string>
#include <vector>

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

// A switch away from another thread than the last one that came reveals that what ran since is unknown.
TEST_F(OneCpu, TellsUntilWhenNobodyKnowsWhatRan) {
  struct Slices : Observer {
    std::vector<SchedSlice> all;
    void on_sched_slice(const SchedSlice& slice) override { all.push_back(slice); }
  } slices;
  const auto change = [&](std::int64_t time, std::int64_t prev, std::int64_t next) {
    SchedSwitch event;
    event.prev_tid = prev;
    event.next_tid = next;
    timeline_.on_switch(kHost, 0, Timestamp{time}, event, &slices);
  };
  change(10, kIdle, kThread);
  change(20, kThread, kIdle);
  change(30, kIdle, kThread);
  change(40, kThread, kOther);
  change(60, kThread, kIdle);  // that kOther left and kThread came was not recorded
  change(70, kIdle, kThread);
  change(80, kThread, kIdle);
  ASSERT_EQ(slices.all.size(), 3U);
  EXPECT_EQ(slices.all[1].begin, Timestamp{30});
  EXPECT_EQ(slices.all[1].unknown_until, std::nullopt) << "it was idle since 20";
  EXPECT_EQ(slices.all[2].begin, Timestamp{70});
  EXPECT_EQ(slices.all[2].unknown_until, Timestamp{60});
}

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
  timeline_.on_user_event(kHost, kThread, 0, Timestamp{10}, true);  // kernel record begins too late
  const auto start = mark(10);
  const auto parts = ThreadTimeline::between(start, mark(18));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 8);
}

TEST_F(OneCpu, AUserEventInTheNanosecondOfTheSwitchOutBelongsBeforeIt) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(10);
  switch_to(20, kIdle, kSleeping);
  timeline_.on_user_event(kHost, kThread, 0, Timestamp{20}, true);
  timeline_.on_waking(kHost, kThread, Timestamp{25});
  switch_to(30, kThread, kRunnable);
  const auto parts = ThreadTimeline::between(start, mark(30));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 10);
  EXPECT_EQ(parts->blocked->ns, 5);
}

// The switches to another thread and back are lost, and nothing tells so: its switch-out names it rightly.
TEST_F(OneCpu, AUserEventOfAnotherThreadBreaksTheRecordOfWhoIsSaidToRun) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(12);
  timeline_.on_user_event(kHost, kOther, 0, Timestamp{20}, true);
  EXPECT_TRUE(ThreadTimeline::between(start, mark(20)).has_value());  // its switch-out may follow
  EXPECT_FALSE(ThreadTimeline::between(start, mark(25)).has_value());
  switch_to(30, kIdle, kSleeping);
  ASSERT_TRUE(hole_.has_value());
  EXPECT_EQ(hole_->begin.ns, 10);
  EXPECT_EQ(hole_->end.ns, 30);
  EXPECT_FALSE(ThreadTimeline::between(start, mark(30)).has_value());
}

TEST_F(OneCpu, WhoeverSpeaksAfterAnotherDidHasBeenSwitchedInAgain) {
  switch_to(10, kThread, kRunnable);
  const auto before = mark(12);
  timeline_.on_user_event(kHost, kOther, 0, Timestamp{20}, true);
  timeline_.on_user_event(kHost, kThread, 0, Timestamp{24}, true);
  const auto start = mark(24);
  EXPECT_FALSE(ThreadTimeline::between(before, start).has_value());
  const auto parts = ThreadTimeline::between(start, mark(24));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 0);
}

TEST_F(OneCpu, ASwitchInTheNanosecondOfTheUserEventThatItBroughtIsNoContradiction) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(12);
  timeline_.on_user_event(kHost, kOther, 0, Timestamp{20}, true);
  switch_to(20, kOther, kRunnable);
  EXPECT_FALSE(hole_.has_value());
  switch_to(26, kThread, kRunnable);
  EXPECT_FALSE(hole_.has_value());
  const auto parts = ThreadTimeline::between(start, mark(30));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 8 + 4);
  EXPECT_EQ(parts->preempted.ns, 6);
}

// LTTng reads the CPU before it writes the event.
TEST_F(OneCpu, AUserEventOfAThreadThatMovesBreaksNobodyElsesRecord) {
  switch_to(10, kThread, kRunnable);
  const auto start = mark(12);
  SchedSwitch elsewhere;
  elsewhere.next_tid = kOther;
  timeline_.on_switch(kHost, 1, Timestamp{21}, elsewhere, nullptr);
  timeline_.on_user_event(kHost, kOther, 0, Timestamp{22}, true);
  switch_to(30, kIdle, kSleeping);
  EXPECT_FALSE(hole_.has_value());
  const auto parts = ThreadTimeline::between(start, mark(30));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 18);
}

// In a container another thread has the number.
TEST_F(OneCpu, AUserEventShowsWhetherTheSwitchesHaveItsThreadThere) {
  using Shown = ThreadTimeline::Shown;
  const auto speak = [this](std::int64_t time, std::int64_t tid) {
    return timeline_.on_user_event(kHost, tid, 0, Timestamp{time}, false);
  };
  EXPECT_EQ(speak(1, kOther), Shown::nothing) << "no switch yet";
  switch_to(10, kThread, kRunnable);
  const auto start = mark(12);
  EXPECT_EQ(speak(10, kOther), Shown::nothing) << "it may have come before the switch";
  EXPECT_EQ(speak(15, kThread), Shown::there);
  EXPECT_EQ(speak(20, kOther), Shown::elsewhere);
  switch_to(30, kIdle, kSleeping);
  EXPECT_FALSE(hole_.has_value());
  const auto parts = ThreadTimeline::between(start, mark(30));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->execution.ns, 18);
}

TEST_F(OneCpu, RemembersTheLastWakingAndTheSwitchInThatFollowed) {
  timeline_.on_waking(kHost, kThread, Timestamp{3});
  timeline_.on_waking(kHost, kThread, Timestamp{7});
  switch_to(11, kThread, kRunnable);
  const auto wake = timeline_.last_wake(kHost, kThread);
  EXPECT_EQ((*wake.waking).ns, 7);
  EXPECT_EQ((*wake.first_in).ns, 11);
  timeline_.forget_wake(kHost, kThread);
  EXPECT_FALSE(timeline_.last_wake(kHost, kThread).waking.has_value());
}

// "tid:ns" of each, in order of appearance.
std::vector<std::string> texts(const std::vector<Preemptor>& preemptors) {
  std::vector<std::string> result;
  for (const auto& preemptor : preemptors) {
    result.push_back(std::to_string(preemptor.tid) + ":" + std::to_string(preemptor.time.ns));
  }
  return result;
}

using Texts = std::vector<std::string>;

TEST_F(OneCpu, NotesWhoRanInstead) {
  switch_to(10, kThread, kRunnable);
  timeline_.begin_watch(kHost, kThread, Timestamp{12});
  const auto start = mark(12);
  switch_to(20, kOther, kRunnable);
  switch_to(23, 300, kSleeping);      // 3 by the other one
  switch_to(30, kThread, kSleeping);  // 7 by a third
  switch_to(40, 300, kRunnable);
  switch_to(45, kThread, kSleeping);  // 5 more by the third
  const auto parts = ThreadTimeline::between(start, mark(50));
  EXPECT_EQ(texts(timeline_.end_watch(kHost, kThread, Timestamp{50})), (Texts{"200:3", "300:12"}));
  EXPECT_EQ(parts->preempted.ns, 3 + 12);
}

TEST_F(OneCpu, NotesWhatRanInCallbacksInstead) {
  switch_to(10, kThread, kRunnable);
  timeline_.begin_watch(kHost, kThread, Timestamp{12});
  switch_to(20, kOther, kRunnable);
  timeline_.begin_watch(kHost, kOther, Timestamp{23});
  switch_to(25, 300, kRunnable);
  switch_to(26, kOther, kSleeping);
  timeline_.end_watch(kHost, kOther, Timestamp{29});
  switch_to(33, kThread, kSleeping);
  const auto preemptors = timeline_.end_watch(kHost, kThread, Timestamp{50});
  EXPECT_EQ(texts(preemptors), (Texts{"200:12", "300:1"}));
  EXPECT_EQ(preemptors[0].in_callbacks.ns, 2 + 3);
  EXPECT_EQ(preemptors[1].in_callbacks.ns, 0);
}

TEST_F(OneCpu, AnotherWatchBeginsAnew) {
  switch_to(10, kThread, kRunnable);
  timeline_.begin_watch(kHost, kThread, Timestamp{12});
  switch_to(20, kOther, kRunnable);
  switch_to(23, kThread, kSleeping);
  timeline_.end_watch(kHost, kThread, Timestamp{50});
  switch_to(30, kOther, kRunnable);  // nobody watches
  switch_to(35, kThread, kSleeping);
  timeline_.begin_watch(kHost, kThread, Timestamp{12});
  switch_to(40, kOther, kRunnable);
  switch_to(44, kThread, kSleeping);
  EXPECT_EQ(texts(timeline_.end_watch(kHost, kThread, Timestamp{50})), Texts{"200:4"});
}

TEST_F(OneCpu, WhoRunsWhileItIsBlockedDoesNotPreemptIt) {
  switch_to(10, kThread, kRunnable);
  timeline_.begin_watch(kHost, kThread, Timestamp{12});
  switch_to(20, kOther, kSleeping);
  timeline_.on_waking(kHost, kThread, Timestamp{22});
  switch_to(25, kThread, kRunnable);
  EXPECT_EQ(texts(timeline_.end_watch(kHost, kThread, Timestamp{50})), Texts{});
}

TEST(TwoCpus, APreemptedThreadThatMigratesWaitsForWhoRunsThere) {
  ThreadTimeline timeline;
  const auto switched = [&timeline](std::int32_t cpu, std::int64_t time, std::int64_t prev,
                                    std::int64_t next) {
    SchedSwitch event;
    event.prev_tid = prev;
    event.prev_state = kRunnable;
    event.next_tid = next;
    timeline.on_switch(kHost, cpu, Timestamp{time}, event, nullptr);
  };
  switched(0, 10, kIdle, kThread);
  switched(1, 10, kIdle, 300);
  timeline.begin_watch(kHost, kThread, Timestamp{12});
  const auto start = timeline.mark(kHost, kThread, Timestamp{12});
  switched(0, 20, kThread, kOther);
  timeline.on_migrate(kHost, kThread, 1, Timestamp{24});  // 4 by the one on CPU 0
  switched(0, 26, kOther, kIdle);                         // no longer its concern
  switched(1, 29, 300, 400);                              // 5 by the one on CPU 1
  switched(1, 30, 400, kThread);                          // 1
  const auto parts = ThreadTimeline::between(start, timeline.mark(kHost, kThread, Timestamp{40}));
  EXPECT_EQ(texts(timeline.end_watch(kHost, kThread, Timestamp{50})),
            (Texts{"200:4", "300:5", "400:1"}));
  ASSERT_TRUE(parts.has_value());
  EXPECT_EQ(parts->preempted.ns, 4 + 5 + 1);
  EXPECT_EQ(parts->execution.ns, 8 + 10);
}

// Linux pulls a thread to an idle CPU; the migration may have been lost.
TEST(TwoCpus, AThreadThatGoesOnElsewhereWaitedWhereItWasPreempted) {
  ThreadTimeline timeline;
  SchedSwitch event;
  event.prev_state = kRunnable;
  event.next_tid = kThread;
  timeline.on_switch(kHost, 0, Timestamp{10}, event, nullptr);
  timeline.begin_watch(kHost, kThread, Timestamp{12});
  event.prev_tid = kThread;
  event.next_tid = kOther;
  event.next_comm = "other";
  timeline.on_switch(kHost, 0, Timestamp{20}, event, nullptr);
  event.prev_tid = kIdle;
  event.next_tid = kThread;
  timeline.on_switch(kHost, 1, Timestamp{27}, event, nullptr);
  const auto preemptors = timeline.end_watch(kHost, kThread, Timestamp{50});
  EXPECT_EQ(texts(preemptors), Texts{"200:7"});
  EXPECT_EQ(preemptors.front().name, "other");
}

TEST_F(OneCpu, IsConfirmedOnceEveryCpuWasHeardOf) {
  switch_to(10, kThread, kRunnable);
  EXPECT_TRUE(timeline_.is_confirmed(kHost, Timestamp{10}));
  EXPECT_FALSE(timeline_.is_confirmed(kHost, Timestamp{11}));
}

}  // namespace
}  // namespace cie::analysis
