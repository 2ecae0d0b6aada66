#include <cie/scheduling/pool_loop.hpp>

#include "loop_support.hpp"

#include <atomic>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

TEST(PoolLoop, RunsEveryReleaseOnce) {
  constexpr int kReleases = 3000;
  NoFailures failures;
  PoolLoop loop{failures};
  std::atomic<int> runs{0};
  const auto callback =
      std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] { ++runs; });
  {
    const RunningLoop running{loop, 3};
    loop.add(callback);
    for (int i = 0; i < kReleases; ++i)
      callback->release();
    wait_for(runs, kReleases);
    callback->serve(nullptr);
  }
  EXPECT_EQ(runs, kReleases);
}

TEST(PoolLoop, NeverOverlapsAMutuallyExclusiveGroup) {
  constexpr int kReleases = 1000;
  NoFailures failures;
  PoolLoop loop{failures};
  const auto shared = group(GroupType::mutually_exclusive);
  std::atomic<int> inside{0};
  std::atomic<int> most{0};
  std::atomic<int> runs{0};
  const auto body = [&] {
    const int now = ++inside;
    if (now > most) most = now;
    std::this_thread::yield();
    --inside;
    ++runs;
  };
  std::vector<std::shared_ptr<Callback>> callbacks;
  std::vector<std::shared_ptr<Counted>> counted;
  for (int i = 0; i < 3; ++i) {
    counted.push_back(std::make_shared<Counted>(shared, body));
    callbacks.push_back(counted.back());
  }
  {
    const RunningLoop running{loop, 4};
    for (const auto& callback : callbacks)
      loop.add(callback);
    for (int i = 0; i < kReleases; ++i) {
      for (const auto& callback : counted)
        callback->release();
    }
    wait_for(runs, 3 * kReleases);
    loop.remove(callbacks);
  }
  EXPECT_EQ(most, 1);
}

// Both instances wait for each other: only an overlap lets them end.
TEST(PoolLoop, OverlapsAReentrantGroup) {
  NoFailures failures;
  PoolLoop loop{failures};
  const auto shared = group(GroupType::reentrant);
  std::atomic<int> arrived{0};
  std::atomic<int> runs{0};
  const auto body = [&] {
    ++arrived;
    wait_for(arrived, 2);
    ++runs;
  };
  const auto first = std::make_shared<Counted>(shared, body);
  const auto second = std::make_shared<Counted>(shared, body);
  const RunningLoop running{loop, 2};
  loop.add(first);
  loop.add(second);
  first->release();
  second->release();
  wait_for(runs, 2);
  loop.remove({first, second});
  EXPECT_EQ(runs, 2);
}

// As many instances as threads wait for each other, all of one callback. What waits before the
// first thread looks is told to the pool once.
TEST(PoolLoop, OverlapsOneReentrantCallbackWithItself) {
  constexpr int kThreads = 4;
  NoFailures failures;
  PoolLoop loop{failures};
  std::atomic<int> arrived{0};
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(group(GroupType::reentrant), [&] {
    const int round = arrived++ / kThreads + 1;
    wait_for(arrived, round * kThreads);
    ++runs;
  });
  for (int i = 0; i < kThreads; ++i)
    callback->release();
  loop.add(callback);
  const RunningLoop running{loop, kThreads};
  wait_for(runs, kThreads);
  for (int i = 0; i < kThreads; ++i)  // and now with the threads asleep
    callback->release();
  wait_for(runs, 2 * kThreads);
  loop.remove({callback});
  EXPECT_EQ(runs, 2 * kThreads);
}

}  // namespace
}  // namespace cie::scheduling
