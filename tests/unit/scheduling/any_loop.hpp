// What every loop keeps, whatever its threads. A test of a loop instantiates it.
#pragma once

#include "loop_support.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {

template <typename LoopType>
class AnyLoop : public testing::Test {};
TYPED_TEST_SUITE_P(AnyLoop);

TYPED_TEST_P(AnyLoop, WaitsForTheRunningInstanceBeforeRemoveReturns) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> started{0};
  std::atomic<bool> may_end{false};
  std::atomic<bool> has_ended{false};
  const auto callback = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] {
    ++started;
    while (!may_end)
      std::this_thread::yield();
    has_ended = true;
  });
  const RunningLoop running{loop, 1};
  loop.add(callback);
  callback->release();
  wait_for(started, 1);
  std::thread remover{[&] {
    loop.remove({callback});
    EXPECT_TRUE(has_ended);
  }};
  may_end = true;
  remover.join();
  callback->release();  // nobody serves it any more
  EXPECT_EQ(started, 1);
}

TYPED_TEST_P(AnyLoop, AbandonsWhatRunsWithoutWaiting) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> started{0};
  std::atomic<bool> has_ended{false};
  std::shared_ptr<Counted> callback;
  callback = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] {
    ++started;
    loop.abandon({callback});  // would wait for itself
    has_ended = true;
  });
  std::weak_ptr<Counted> watch = callback;
  const RunningLoop running{loop, 1};
  loop.add(callback);
  callback->release();
  wait_for(started, 1);
  while (!has_ended)
    std::this_thread::yield();
  callback->release();
  callback.reset();
  while (!watch.expired())  // the loop lets go of it
    std::this_thread::yield();
  EXPECT_EQ(started, 1);
}

TYPED_TEST_P(AnyLoop, ReportsAnExceptionAndGoesOn) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] {
    ++runs;
    throw 1;
  });
  const RunningLoop running{loop, 1};
  loop.add(callback);
  callback->release();
  callback->release();
  wait_for(runs, 2);
  loop.remove({callback});
  EXPECT_EQ(failures.count, 2);
}

TYPED_TEST_P(AnyLoop, RunsEveryReleaseOfEveryCallbackOnce) {
  constexpr int kReleases = 2000;
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> runs{0};
  std::vector<std::shared_ptr<Counted>> callbacks;
  std::vector<std::shared_ptr<Callback>> all;
  for (int i = 0; i < 3; ++i) {
    callbacks.push_back(
        std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] { ++runs; }));
    all.push_back(callbacks.back());
  }
  const RunningLoop running{loop, 1};
  for (const auto& callback : callbacks)
    loop.add(callback);
  std::vector<std::thread> releasers;
  for (const auto& callback : callbacks) {
    releasers.emplace_back([&callback] {
      for (int i = 0; i < kReleases; ++i)
        callback->release();
    });
  }
  for (auto& releaser : releasers)
    releaser.join();
  wait_for(runs, 3 * kReleases);
  loop.remove(all);
  EXPECT_EQ(runs, 3 * kReleases);
}

TYPED_TEST_P(AnyLoop, TakesACallbackBackThatWasReadyWhenItWent) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> runs{0};
  const auto callback =
      std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] { ++runs; });
  loop.add(callback);
  callback->release();
  loop.remove({callback});  // no thread has run it
  const RunningLoop running{loop, 1};
  loop.add(callback);
  wait_for(runs, 1);
  loop.remove({callback});
  EXPECT_EQ(runs, 1);
}

// The thread has found something to run, and comes to it when cancel() has returned.
TYPED_TEST_P(AnyLoop, BeginsNothingOnceItIsCancelled) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> taking{0};
  std::atomic<bool> has_cancelled{false};
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(
      group(GroupType::mutually_exclusive), [&] { ++runs; },
      [&] {
        ++taking;
        while (!has_cancelled)
          std::this_thread::yield();
      });
  callback->release();
  loop.add(callback);
  std::thread runner{[&] { loop.run(kNever); }};
  wait_for(taking, 1);
  failures.cancellation.cancel();
  loop.wake();
  has_cancelled = true;
  runner.join();  // of itself
  EXPECT_EQ(runs, 0);
  EXPECT_EQ(callback->queued(), 1U);
  loop.remove({callback});
}

// The loop looks for work, and stands still there until somebody else was notified.
TYPED_TEST_P(AnyLoop, IsNotifiedWhileItLooksForWork) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> looks{0};
  std::atomic<bool> is_notified{false};
  std::atomic<bool> has_given_up{false};
  const auto slow = std::make_shared<SlowToAsk>([&] {
    ++looks;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{5};
    while (!is_notified && !has_given_up) {
      if (std::chrono::steady_clock::now() > end) has_given_up = true;
      std::this_thread::yield();
    }
  });
  const auto other = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [] {});
  loop.add(other);
  loop.add(slow);
  const RunningLoop running{loop, 1};
  wait_for(looks, 1);
  other->release();
  is_notified = true;
  loop.remove({slow, other});
  EXPECT_FALSE(has_given_up);
}

REGISTER_TYPED_TEST_SUITE_P(AnyLoop, AbandonsWhatRunsWithoutWaiting, BeginsNothingOnceItIsCancelled,
                            IsNotifiedWhileItLooksForWork,
                            WaitsForTheRunningInstanceBeforeRemoveReturns,
                            ReportsAnExceptionAndGoesOn, RunsEveryReleaseOfEveryCallbackOnce,
                            TakesACallbackBackThatWasReadyWhenItWent);

}  // namespace cie::scheduling
