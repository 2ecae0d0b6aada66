#include "pool_loop.hpp"

#include "clock.hpp"
#include "serial_loop.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

// Released as often as release() was called.
class Counted final : public Callback {
 public:
  Counted(std::shared_ptr<GroupState> group, std::function<void()> function)
      : Callback(std::move(group), info()), function_(std::move(function)) {}
  bool execute_one() override {
    int left = left_.load();
    do {
      if (left == 0) return false;
    } while (!left_.compare_exchange_weak(left, left - 1));
    function_();
    return true;
  }
  std::int64_t next_due() const noexcept override { return kNever; }
  void serve(ReadySink* sink) override {
    sink_ = sink;
    if (sink != nullptr) sink->on_ready(*this);
  }
  void release() {
    ++left_;
    if (ReadySink* const sink = sink_; sink != nullptr) sink->on_ready(*this);
  }

 private:
  static trace::CallbackInfo info() {
    trace::CallbackInfo info;
    info.logical_id = trace::unique_logical_id("/test@Waitable(x)");
    info.kind = CallbackKind::waitable;
    return info;
  }
  std::function<void()> function_;
  std::atomic<int> left_{0};
  std::atomic<ReadySink*> sink_{nullptr};
};

class NoFailures final : public FailureSink {
 public:
  void on_failure(Callback&, std::exception_ptr) noexcept override { ++count; }
  std::atomic<int> count{0};
};

std::shared_ptr<GroupState> group(GroupType type) {
  return std::make_shared<GroupState>(kNoNode, type);
}

struct Running {
  Running(Loop& running_loop, int threads) : loop(running_loop) {
    for (int i = 0; i < threads; ++i)
      workers.emplace_back([this] { loop.run(kNever); });
  }
  ~Running() {
    loop.stop();
    for (auto& worker : workers)
      worker.join();
  }
  Loop& loop;
  std::vector<std::thread> workers;
};

void wait_for(const std::atomic<int>& count, int value) {
  while (count < value)
    std::this_thread::yield();
}

TEST(PoolLoop, RunsEveryReleaseOnce) {
  constexpr int kReleases = 3000;
  NoFailures failures;
  PoolLoop loop{failures};
  std::atomic<int> runs{0};
  const auto callback =
      std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] { ++runs; });
  {
    const Running running{loop, 3};
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
    const Running running{loop, 4};
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
  const Running running{loop, 2};
  loop.add(first);
  loop.add(second);
  first->release();
  second->release();
  wait_for(runs, 2);
  loop.remove({first, second});
  EXPECT_EQ(runs, 2);
}

template <typename LoopType>
class AnyLoop : public testing::Test {};
using Loops = testing::Types<SerialLoop, PoolLoop>;
TYPED_TEST_SUITE(AnyLoop, Loops);

TYPED_TEST(AnyLoop, WaitsForTheRunningInstanceBeforeRemoveReturns) {
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
  const Running running{loop, 1};
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

TYPED_TEST(AnyLoop, ReportsAnExceptionAndGoesOn) {
  NoFailures failures;
  TypeParam loop{failures};
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] {
    ++runs;
    throw 1;
  });
  const Running running{loop, 1};
  loop.add(callback);
  callback->release();
  callback->release();
  wait_for(runs, 2);
  loop.remove({callback});
  EXPECT_EQ(failures.count, 2);
}

}  // namespace
}  // namespace cie::executor
