// Nodes come and go, executors start and end, callbacks throw.
#include "executors.hpp"
#include "support.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::test {
namespace {

using cie_msgs::Sample;

class AnyExecutor : public testing::TestWithParam<Kind> {
 protected:
  std::unique_ptr<Executor> make(ExecutorOptions options = {}) {
    return test::make(GetParam(), std::move(options));
  }
  Context context{private_options()};
};

INSTANTIATE_TEST_SUITE_P(Executors, AnyExecutor, every_executor(), name_of);

TEST_P(AnyExecutor, ServesANodeAddedWhileSpinning) {
  const auto executor = make();
  Spinning spinning{*executor};
  Node node{context, "late"};
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; });
  executor->add_node(node);
  EXPECT_TRUE(eventually([&] { return runs > 2; }));
  executor->remove_node(node);
}

TEST_P(AnyExecutor, ServesCallbacksCreatedWhileSpinning) {
  const auto executor = make();
  Node node{context, "node"};
  executor->add_node(node);
  Spinning spinning{*executor};
  std::atomic<int> runs{0};
  std::atomic<int> messages{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; });
  const auto publisher = node.create_publisher<Sample>("data", 1);
  const auto subscription =
      node.create_subscription<Sample>("data", 1, [&](const Sample&) { ++messages; });
  publisher->publish(*make_message<Sample>());
  EXPECT_TRUE(eventually([&] { return runs > 2 && messages == 1; }));
  spinning.cancel_and_wait();
}

TEST_P(AnyExecutor, LetsACallbackCreateCallbacks) {
  const auto executor = make();
  Node node{context, "node"};
  std::atomic<int> runs{0};
  std::atomic<bool> has_created{false};
  std::shared_ptr<Timer> second_timer;
  const auto timer = node.create_wall_timer(1ms, [&] {
    if (has_created.exchange(true)) return;
    second_timer = node.create_wall_timer(1ms, [&] { ++runs; });
  });
  executor->add_node(node);
  Spinning spinning{*executor};
  EXPECT_TRUE(eventually([&] { return runs > 2; }));
  spinning.cancel_and_wait();
}

TEST_P(AnyExecutor, RunsNothingOfANodeOnceItIsRemoved) {
  const auto executor = make();
  Node stays{context, "stays"};
  std::atomic<int> others{0};
  const auto timer = stays.create_wall_timer(1ms, [&] { ++others; });
  Node goes{context, "goes"};
  std::atomic<int> runs{0};
  std::atomic<bool> is_inside{false};
  const auto second_timer = goes.create_wall_timer(1ms, [&] {
    is_inside = true;
    std::this_thread::sleep_for(2ms);
    ++runs;
    is_inside = false;
  });
  executor->add_node(stays);
  executor->add_node(goes);
  Spinning spinning{*executor};
  ASSERT_TRUE(eventually([&] { return runs > 0; }));
  executor->remove_node(goes);
  EXPECT_FALSE(is_inside);
  const int at_removal = runs;
  const int others_at_removal = others;
  EXPECT_TRUE(eventually([&] { return others > others_at_removal + 5; }));
  EXPECT_EQ(runs, at_removal);
  // And it may come back, here or elsewhere.
  executor->add_node(goes);
  EXPECT_TRUE(eventually([&] { return runs > at_removal; }));
  spinning.cancel_and_wait();
}

TEST_P(AnyExecutor, LetsANodeGoThatIsDestroyedWhileSpinning) {
  const auto executor = make();
  Spinning spinning{*executor};
  for (int i = 0; i < 5; ++i) {
    auto node = std::make_unique<Node>(context, "shortlived");
    std::atomic<int> runs{0};
    const auto timer = node->create_wall_timer(1ms, [&] { ++runs; });
    executor->add_node(*node);
    EXPECT_TRUE(eventually([&] { return runs > 0; }));
    node.reset();  // `runs` must not be touched any more
  }
  spinning.cancel_and_wait();
}

TEST_P(AnyExecutor, SpinsAgainAfterCancel) {
  const auto executor = make();
  Node node{context, "node"};
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; });
  executor->add_node(node);
  for (int round = 0; round < 3; ++round) {
    const int before = runs;
    Spinning spinning{*executor};
    EXPECT_TRUE(eventually([&] { return runs > before; }));
    spinning.cancel_and_wait();
    EXPECT_FALSE(executor->is_spinning());
  }
}

TEST_P(AnyExecutor, ReturnsAtOnceWhenCancelledBefore) {
  const auto executor = make();
  executor->cancel();
  executor->spin();
  SUCCEED();
}

TEST_P(AnyExecutor, IsCancelledByItsOwnCallback) {
  const auto executor = make();
  Node node{context, "node"};
  const auto timer = node.create_wall_timer(1ms, [&] { executor->cancel(); });
  executor->add_node(node);
  executor->spin();
  SUCCEED();
}

Executor* interrupted = nullptr;

TEST_P(AnyExecutor, IsCancelledByASignalHandler) {
  const auto executor = make();
  interrupted = executor.get();
  struct sigaction action {};
  struct sigaction before {};
  action.sa_handler = [](int) { interrupted->cancel(); };
  ASSERT_EQ(sigaction(SIGUSR1, &action, &before), 0);
  Node node{context, "node"};
  const auto timer = node.create_wall_timer(1ms, [] { kill(getpid(), SIGUSR1); });
  executor->add_node(node);
  executor->spin();
  sigaction(SIGUSR1, &before, nullptr);
}

TEST_P(AnyExecutor, EndsAfterTheTimeItWasGiven) {
  const auto executor = make();
  Node node{context, "node"};
  const auto timer = node.create_wall_timer(1ms, [] {});
  executor->add_node(node);
  executor->spin_for(5ms);
  EXPECT_FALSE(executor->is_spinning());
}

struct NoFuel : std::runtime_error {
  using std::runtime_error::runtime_error;
};

TEST_P(AnyExecutor, ThrowsWhatACallbackThrewWithItsId) {
  const auto executor = make();
  Node node{context, "node"};
  const auto timer = node.create_wall_timer(1ms, [] { throw NoFuel{"no more fuel"}; });
  executor->add_node(node);
  try {
    executor->spin();
    FAIL() << "spin() returned";
  } catch (const std::exception& error) {
    EXPECT_EQ(error.what(), "callback \"" + timer->logical_id() + "\" threw: no more fuel");
    EXPECT_THROW(std::rethrow_if_nested(error), NoFuel);
    const auto* failed = dynamic_cast<const CallbackError*>(&error);
    ASSERT_NE(failed, nullptr);
    EXPECT_EQ(failed->failure().callback, timer->id());
    EXPECT_EQ(failed->failure().logical_id, timer->logical_id());
  }
}

TEST_P(AnyExecutor, ThrowsWhatIsNoExceptionOfTheLibrary) {
  const auto executor = make();
  Node node{context, "node"};
  const auto timer = node.create_wall_timer(1ms, [] { throw 5; });
  executor->add_node(node);
  try {
    executor->spin();
    FAIL() << "spin() returned";
  } catch (const CallbackError& error) {
    EXPECT_EQ(error.what(), "callback \"" + timer->logical_id() +
                                "\" threw: an exception that is no std::exception");
    EXPECT_THROW(error.rethrow_nested(), int);
  }
}

TEST_P(AnyExecutor, GivesAnExceptionToItsHandlerAndGoesOn) {
  std::atomic<int> failures{0};
  std::string id;
  ExecutorOptions options;
  options.on_exception = [&](const CallbackFailure& failure) {
    if (++failures == 1) id = failure.logical_id;
    EXPECT_THROW(std::rethrow_exception(failure.exception), int);
  };
  const auto executor = make(options);
  Node node{context, "node"};
  const auto timer = node.create_wall_timer(1ms, [] { throw 5; });
  executor->add_node(node);
  Spinning spinning{*executor};
  EXPECT_TRUE(eventually([&] { return failures > 3; }));
  spinning.cancel_and_wait();
  EXPECT_EQ(id, timer->logical_id());
}

TEST_P(AnyExecutor, RefusesWrongUse) {
  const auto executor = make();
  const auto other = make();
  Node node{context, "node"};
  executor->add_node(node);
  EXPECT_THROW(executor->add_node(node), std::logic_error);
  EXPECT_THROW(other->add_node(node), std::logic_error);
  EXPECT_THROW(other->remove_node(node), std::logic_error);
  std::atomic<bool> is_refused{false};
  const auto timer = node.create_wall_timer(1ms, [&] {
    try {
      executor->remove_node(node);
    } catch (const std::logic_error&) {
      is_refused = true;
    }
  });
  Spinning spinning{*executor};
  EXPECT_TRUE(eventually([&] { return is_refused.load(); }));
  EXPECT_THROW(executor->spin(), std::logic_error);
  spinning.cancel_and_wait();
}

TEST_P(AnyExecutor, LeavesNoThreadBehind) {
  const auto idle = make();  // the tracer's own thread comes with the first executor
  const std::size_t before = settled(thread_count);
  const auto executor = make();
  Node node{context, "node"};
  std::vector<std::shared_ptr<Timer>> timers;
  for (int i = 0; i < 8; ++i)
    timers.push_back(node.create_wall_timer(1ms, [] {}));
  executor->add_node(node);
  executor->spin_for(10ms);
  // The kernel lists a thread for a moment after it was joined.
  EXPECT_TRUE(eventually([&] { return thread_count() <= before; }));
}

TEST(Executors, AreMadeByName) {
  for (const std::string_view name : kExecutorNames)
    EXPECT_NE(make_executor(name), nullptr) << name;
  EXPECT_THROW(make_executor("futex"), std::invalid_argument);
  EXPECT_THROW(make_executor("events-waitset"), std::invalid_argument);
}

TEST(Isolated, RunsEachCallbackOnAThreadOfItsOwn) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor;
  Node node{context, "node"};
  constexpr int kTimers = 6;
  std::array<std::atomic<std::thread::id>, kTimers> first;
  std::array<std::atomic<int>, kTimers> runs{};
  std::atomic<bool> has_moved{false};
  std::vector<std::shared_ptr<Timer>> timers;
  for (std::size_t i = 0; i < kTimers; ++i) {
    timers.push_back(node.create_wall_timer(1ms, [&, i] {
      const auto self = std::this_thread::get_id();
      if (runs[i] == 0) first[i] = self;
      if (first[i].load() != self) has_moved = true;
      ++runs[i];
    }));
  }
  executor.add_node(node);
  Spinning spinning{executor};
  EXPECT_TRUE(eventually(
      [&] { return std::ranges::all_of(runs, [](const auto& count) { return count > 5; }); }));
  spinning.cancel_and_wait();
  EXPECT_FALSE(has_moved);
  std::set<std::thread::id> threads;
  for (const auto& thread : first)
    threads.insert(thread.load());
  EXPECT_EQ(threads.size(), std::size_t{kTimers});
}

TEST(Isolated, PutsAGroupOnOneThreadAndNeverOverlapsIt) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor;
  Node node{context, "node"};
  CallbackOptions together;
  together.group = node.create_callback_group(GroupType::mutually_exclusive);
  TimerOptions options;
  options.group = together.group;
  std::set<std::thread::id> threads;  // unlocked on purpose: the group is the lock
  int runs = 0;
  std::atomic<int> seen{0};  // how many runs the test may know of while they go on
  std::atomic<int> published{0};
  const auto body = [&] {
    threads.insert(std::this_thread::get_id());
    seen = ++runs;
  };
  const auto timer = node.create_wall_timer(1ms, body, options);
  const auto second_timer = node.create_wall_timer(1ms, body, options);
  const auto subscription = node.create_subscription<Sample>(
      "data", 10, [&](const Sample&) { body(); }, together);
  const auto publisher = node.create_publisher<Sample>("data", 10);
  executor.add_node(node);
  Spinning spinning{executor};
  const auto third_timer = node.create_wall_timer(1ms, [&] {
    publisher->publish(*make_message<Sample>());
    ++published;
  });
  EXPECT_TRUE(eventually([&] { return published > 20 && seen > 20; }));
  spinning.cancel_and_wait();
  EXPECT_EQ(threads.size(), 1U);
}

TEST(Isolated, GivesAReentrantGroupAPool) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor{{.reentrant_threads = 2}};
  Node node{context, "node"};
  TimerOptions options;
  options.group = node.create_callback_group(GroupType::reentrant);
  std::atomic<int> arrived{0};
  std::atomic<int> ended{0};
  const auto meet = [&] {  // ends only if both run at once
    ++arrived;
    while (arrived < 2)
      std::this_thread::yield();
    ++ended;
  };
  const auto timer = node.create_wall_timer(1ms, meet, options);
  const auto second_timer = node.create_wall_timer(1ms, meet, options);
  executor.add_node(node);
  Spinning spinning{executor};
  EXPECT_TRUE(eventually([&] { return ended >= 2; }));
  spinning.cancel_and_wait();
}

class Pools : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Executors, Pools,
                         testing::Values("isolated", "multi", "isolated-waitset", "multi-waitset"),
                         name_of);

// Three messages are handled by three threads at once: each instance waits for the others.
TEST_P(Pools, RunOneReentrantSubscriptionOnSeveralThreadsAtOnce) {
  constexpr int kThreads = 3;
  Context context{private_options()};
  const auto executor = make(GetParam(), {.reentrant_threads = kThreads, .threads = kThreads});
  Node node{context, "node"};
  CallbackOptions options;
  options.group = node.create_callback_group(GroupType::reentrant);
  std::atomic<int> arrived{0};
  std::atomic<int> ended{0};
  std::mutex mutex;
  std::set<std::thread::id> threads;
  const auto subscription = node.create_subscription<Sample>(
      "data", 10,
      [&](const Sample&) {
        {
          const std::lock_guard lock{mutex};
          threads.insert(std::this_thread::get_id());
        }
        const int round = arrived++ / kThreads + 1;
        eventually([&] { return arrived >= round * kThreads; });
        ++ended;
      },
      options);
  const auto publisher = node.create_publisher<Sample>("data", 10);
  const auto publish = [&] {
    for (int i = 0; i < kThreads; ++i)
      publisher->publish(*make_message<Sample>());
  };
  publish();  // they wait when the pool comes
  executor->add_node(node);
  Spinning spinning{*executor};
  ASSERT_TRUE(eventually([&] { return ended == kThreads; }, 5s));
  EXPECT_EQ(threads.size(), std::size_t{kThreads});
  publish();  // the pool waits when they come
  ASSERT_TRUE(eventually([&] { return ended == 2 * kThreads; }, 5s));
  spinning.cancel_and_wait();
}

TEST(LogicalIds, AreToldApartByNameOrByOrder) {
  Context context{private_options()};
  Node node{context, "twins", "/ids"};
  const auto first = node.create_wall_timer(10ms, [] {});
  const auto second = node.create_wall_timer(10ms, [] {});
  TimerOptions named;
  named.name = "slow";
  const auto third = node.create_wall_timer(
      10ms, [] {}, named);
  EXPECT_EQ(first->logical_id(), "/ids/twins@Timer(10000000)");
  EXPECT_EQ(second->logical_id(), "/ids/twins@Timer(10000000)#2");
  EXPECT_EQ(third->logical_id(), "/ids/twins@Timer(slow)");
}

TEST(Timers, HaveANameOfTheirOwnInANode) {
  Context context{private_options()};
  Node node{context, "node"};
  const auto named = [&node](const char* name, std::chrono::nanoseconds period = 10ms) {
    TimerOptions options;
    options.name = name;
    return node.create_wall_timer(
        period, [] {}, options);
  };
  auto tick = named("tick");
  EXPECT_THROW((void)named("tick", 20ms), std::invalid_argument) << "it is taken";
  EXPECT_THROW((void)named("20000000"), std::invalid_argument) << "that is a period";
  tick.reset();
  EXPECT_EQ(named("tick", 20ms)->logical_id(), "/node@Timer(tick)") << "whatever its period";
}

TEST(Groups, OfAnotherNodeAreRefused) {
  Context context{private_options()};
  Node mine{context, "mine"};
  Node other{context, "other"};
  TimerOptions options;
  options.group = other.create_callback_group(GroupType::mutually_exclusive);
  EXPECT_THROW((void)mine.create_wall_timer(
                   1ms, [] {}, options),
               std::logic_error);
}

TEST(Contexts, AreOnePerDomain) {
  const Context context{private_options()};
  EXPECT_THROW(Context{private_options()}, std::logic_error);
}

TEST(Contexts, RefuseWhatTheyCannotUse) {
  EXPECT_THROW((Context{{.domain = 233}}), std::invalid_argument);
  EXPECT_NO_THROW((Context{{.domain = 232, .loopback = true, .tag = "most"}}));
  EXPECT_THROW((Context{{.domain = 1, .loopback = true, .tag = "<x>"}}), std::invalid_argument);
  EXPECT_THROW((Context{{.domain = 1, .tag = "x"}}), std::invalid_argument);
}

TEST(Timers, RefuseAPeriodThatIsNone) {
  Context context{private_options()};
  Node node{context, "node"};
  EXPECT_THROW((void)node.create_wall_timer(0ns, [] {}), std::invalid_argument);
  EXPECT_THROW((void)node.create_wall_timer(-1s, [] {}), std::invalid_argument);
}

// The destructor of everything, over and over: what races at the end shows here.
TEST_P(AnyExecutor, IsCreatedSpunCancelledAndDestroyedHundredsOfTimes) {
  constexpr int kRounds = 150;
  Node partner{context, "partner"};
  const auto publisher = partner.create_publisher<Sample>("data", 10);
  const auto message = make_message<Sample>();
  for (int round = 0; round < kRounds; ++round) {
    std::atomic<int> runs{0};
    Node node{context, "node"};
    const auto executor = make();
    const auto timer = node.create_wall_timer(1ms, [&] { ++runs; }, {.phase = 0ns});
    const auto subscription =
        node.create_subscription<Sample>("data", 10, [&](const Sample&) { ++runs; });
    executor->add_node(node);
    std::thread canceller{[&] {
      publisher->publish(*message);
      if (round % 2 == 0) eventually([&] { return runs > 0; });
      executor->cancel();
    }};
    executor->spin();
    canceller.join();
  }
}

}  // namespace
}  // namespace cie::test
