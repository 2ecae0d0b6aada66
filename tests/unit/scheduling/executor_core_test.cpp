// Spinning, cancelling and membership, with nodes and callbacks of the tests' own.
#include <cie/scheduling/events_loop.hpp>
#include <cie/scheduling/executor_core.hpp>
#include <cie/scheduling/own_thread.hpp>
#include <cie/scheduling/serial_loop.hpp>
#include <cie/scheduling/shared_pool.hpp>
#include <cie/scheduling/thread_per_group.hpp>

#include "loop_support.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

class TestNode final : public ServedNode {
 public:
  explicit TestNode(std::vector<std::shared_ptr<Callback>> callbacks)
      : callbacks_(std::move(callbacks)) {}
  const std::string& name() const noexcept override { return name_; }
  std::vector<std::shared_ptr<Callback>> callbacks() const override { return callbacks_; }
  std::vector<AnnouncedThread> workers() const override { return {}; }
  void join(std::shared_ptr<ExecutorCore>) override {}
  void leave() override {}

 private:
  std::string name_ = "/test";
  std::vector<std::shared_ptr<Callback>> callbacks_;
};

struct Kind {
  const char* name;
  ExecutorKind kind;
  PlacementFactory placement;
};

template <typename LoopType>
std::unique_ptr<Placement> own_thread(const PlacementParts& parts) {
  return std::make_unique<OwnThread>(std::make_unique<LoopType>(parts.loops));
}

std::vector<Kind> kinds() {
  return {{"Isolated", ExecutorKind::isolated,
           [](const PlacementParts& parts) {
             return std::make_unique<ThreadPerGroup>(parts, make_lean_loop);
           }},
          {"Multi", ExecutorKind::multi_threaded,
           [](const PlacementParts& parts) {
             return std::make_unique<SharedPool>(parts, make_lean_loop);
           }},
          {"Single", ExecutorKind::single_threaded, own_thread<SerialLoop>},
          {"Events", ExecutorKind::events, own_thread<EventsLoop>}};
}

class EveryCore : public testing::TestWithParam<Kind> {
 protected:
  static std::shared_ptr<ExecutorCore> core(const ExecutorOptions& options = {.threads = 2}) {
    return std::make_shared<ExecutorCore>(GetParam().kind, options, GetParam().placement);
  }
  static std::shared_ptr<ExecutorCore> core_of(std::vector<std::shared_ptr<Callback>> callbacks) {
    auto made = core();
    made->add_node(std::make_shared<TestNode>(std::move(callbacks)));
    return made;
  }
  static std::shared_ptr<GroupState> own_group() { return group(GroupType::mutually_exclusive); }
};

INSTANTIATE_TEST_SUITE_P(Executors, EveryCore, testing::ValuesIn(kinds()),
                         [](const auto& parameter) { return parameter.param.name; });

// The thread has found something to run, and comes to it when cancel() has returned.
TEST_P(EveryCore, BeginsNothingOnceCancelHasReturnedAndLosesNothing) {
  std::atomic<int> taking{0};
  std::atomic<bool> has_cancelled{false};
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(
      own_group(), [&] { ++runs; },
      [&] {
        ++taking;
        while (!has_cancelled)
          std::this_thread::yield();
      });
  const auto core = core_of({callback});
  callback->release();
  std::thread spinning{[&] { core->spin(kNever); }};
  wait_for(taking, 1);
  core->cancel();
  has_cancelled = true;
  spinning.join();
  EXPECT_EQ(runs, 0);
  std::thread again{[&] { core->spin(kNever); }};
  wait_for(runs, 1);
  core->cancel();
  again.join();
  EXPECT_EQ(runs, 1) << "what was found for the instance that did not begin";
}

TEST_P(EveryCore, DoesNotRunTheCallbackThatCancelsAgain) {
  constexpr int kReleases = 1000;
  std::shared_ptr<ExecutorCore> core;
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(own_group(), [&] {
    ++runs;
    core->cancel();
  });
  core = core_of({callback});
  for (int i = 0; i < kReleases; ++i)
    callback->release();
  core->spin(kNever);
  EXPECT_EQ(runs, 1);
  core->spin(kNever);
  EXPECT_EQ(runs, 2);
}

TEST_P(EveryCore, RunsNothingInASpinThatWasCancelledBefore) {
  std::atomic<int> runs{0};
  const auto callback = std::make_shared<Counted>(own_group(), [&] { ++runs; });
  const auto core = core_of({callback});
  callback->release();
  core->cancel();
  core->spin(kNever);
  EXPECT_EQ(runs, 0);
}

// Both are inside before the first removes the other's node: the second would wait for ever.
TEST_P(EveryCore, RefusesToRemoveTheNodeOfACallbackThatWaitsForTheCaller) {
  struct Side {
    std::shared_ptr<ExecutorCore> core;
    std::shared_ptr<TestNode> node;
    std::shared_ptr<Counted> callback;
  };
  std::array<Side, 2> sides;
  std::atomic<int> inside{0};
  std::atomic<int> removed{0};
  std::atomic<int> refused{0};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    Side& side = sides.at(i);
    const Side& other = sides.at(1 - i);
    side.callback = std::make_shared<Counted>(own_group(), [&] {
      ++inside;
      wait_for(inside, 2);
      try {
        other.core->remove_node(*other.node);
        ++removed;
      } catch (const std::logic_error&) {
        ++refused;
      }
    });
    side.node = std::make_shared<TestNode>(Placement::Callbacks{side.callback});
    side.core = core();
    side.core->add_node(side.node);
    side.callback->release();
  }
  std::vector<std::thread> spinning;
  for (const Side& side : sides)
    spinning.emplace_back([core = side.core] { core->spin(kNever); });
  wait_for(inside, 2);
  while (removed + refused < 2)
    std::this_thread::yield();
  for (const Side& side : sides)
    side.core->cancel();
  for (std::thread& each : spinning)
    each.join();
  EXPECT_EQ(removed, 1);
  EXPECT_EQ(refused, 1);
}

// Spins until the deadline, and is told when the spin ends.
class Ending final : public Placement {
 public:
  explicit Ending(std::function<void()> at_end) : at_end_(std::move(at_end)) {}
  bool is_on_thread_of(const Callbacks&) const override { return false; }
  Waiting stop() override { return at_end_; }

 protected:
  Teams place(const Callbacks&) override { return {}; }
  Vacating take_off(const Callbacks&) override {
    return [](Running) { return Teams{}; };
  }
  void reset() override {}

 private:
  std::function<void()> at_end_;
};

// Its own deadline has ended the first spin, so it is the second's.
TEST(ExecutorCoreTest, KeepsACancelThatComesAfterTheDeadlineForTheNextSpin) {
  std::shared_ptr<ExecutorCore> core;
  core = std::make_shared<ExecutorCore>(ExecutorKind::isolated, ExecutorOptions{},
                                        [&core](const PlacementParts&) {
                                          return std::make_unique<Ending>([&core] {
                                            if (core != nullptr)
                                              std::exchange(core, nullptr)->cancel();
                                          });
                                        });
  const auto spinning = core;
  spinning->spin(monotonic_now());
  EXPECT_EQ(core, nullptr) << "it was cancelled";
  constexpr std::int64_t kLong = 20'000'000'000;
  const std::int64_t deadline = monotonic_now() + kLong;
  spinning->spin(deadline);
  EXPECT_LT(monotonic_now(), deadline);
}

}  // namespace
}  // namespace cie::scheduling
