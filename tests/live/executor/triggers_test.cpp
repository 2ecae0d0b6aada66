// Callbacks that the program triggers, and timers that it stops and starts.
#include "executors.hpp"
#include "support.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

class Triggers : public testing::TestWithParam<Kind> {
 protected:
  std::unique_ptr<Executor> make() { return test::make(GetParam()); }
  // Lets the executor do whatever it has to do: another callback runs `kOthers` times.
  void let_others_run() {
    const int before = others;
    ASSERT_TRUE(eventually([&] { return others > before + kOthers; }));
  }
  static constexpr int kOthers = 10;
  Context context{private_options()};
  Node node{context, "node"};
  std::atomic<int> others{0};
  std::shared_ptr<Timer> other = node.create_wall_timer(1ms, [this] { ++others; });
};

INSTANTIATE_TEST_SUITE_P(Executors, Triggers, every_executor(), name_of);

TEST_P(Triggers, RunAGuardConditionOncePerTriggerThatItSaw) {
  std::atomic<int> runs{0};
  const auto guard_condition = node.create_guard_condition("work", [&] { ++runs; });
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  for (int i = 1; i <= 200; ++i) {
    guard_condition->trigger();
    ASSERT_TRUE(eventually([&] { return runs == i; }));
  }
  let_others_run();
  EXPECT_EQ(runs, 200);
}

TEST_P(Triggers, AreOneUntilTheInstanceStarts) {
  std::atomic<int> runs{0};
  const auto guard_condition = node.create_guard_condition("work", [&] { ++runs; });
  for (int i = 0; i < 5; ++i)
    guard_condition->trigger();  // before anybody serves it
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  EXPECT_TRUE(eventually([&] { return runs > 0; }));
  let_others_run();
  EXPECT_EQ(runs, 1);
}

TEST_P(Triggers, OfSeveralThreadsAreNeverLost) {
  constexpr int kThreads = 3;
  constexpr int kEach = 500;
  std::atomic<int> given{0};
  std::atomic<int> seen{0};
  const auto guard_condition = node.create_guard_condition("work", [&] { seen = given.load(); });
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < kEach; ++k) {
        ++given;
        guard_condition->trigger();
      }
    });
  }
  for (auto& thread : threads)
    thread.join();
  EXPECT_TRUE(eventually([&] { return seen == kThreads * kEach; }));
}

TEST_P(Triggers, WhileTheGuardConditionComesAndGoes) {
  std::atomic<int> runs{0};
  const auto executor = make();
  const Spinning spinning{*executor};
  for (int round = 0; round < 30; ++round) {
    Node shortlived{context, "shortlived"};
    const auto guard_condition = shortlived.create_guard_condition("work", [&] { ++runs; });
    std::atomic<bool> is_ending{false};
    std::thread triggering{[&] {
      while (!is_ending)
        guard_condition->trigger();
    }};
    const int before = runs;
    executor->add_node(shortlived);
    EXPECT_TRUE(eventually([&] { return runs > before; }));
    executor->remove_node(shortlived);
    const int at_removal = runs;
    guard_condition->trigger();
    EXPECT_EQ(runs, at_removal);
    is_ending = true;
    triggering.join();
  }
}

TEST_P(Triggers, LetATimerEndItself) {
  std::atomic<int> runs{0};
  std::shared_ptr<Timer> timer;
  timer = node.create_wall_timer(1ms, [&] {
    if (++runs == 3) timer->cancel();
  });
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  ASSERT_TRUE(eventually([&] { return timer->is_cancelled(); }));
  let_others_run();
  EXPECT_EQ(runs, 3);
}

TEST_P(Triggers, StopATimerAndStartItAgain) {
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; });
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  for (int round = 0; round < 5; ++round) {
    const int at_start = runs;
    ASSERT_TRUE(eventually([&] { return runs > at_start + 2; }));
    timer->cancel();
    const int at_end = runs;
    let_others_run();
    EXPECT_LE(runs, at_end + 1);  // the one that had begun
    timer->reset();
    EXPECT_FALSE(timer->is_cancelled());
  }
}

// A pause between two spins is time in which periods are missed, unless the timer is reset.
TEST_P(Triggers, StartATimerAnewAfterAPause) {
  using Clock = std::chrono::steady_clock;
  constexpr auto kPeriod = 50ms;
  std::atomic<int> runs{0};
  std::atomic<Clock::time_point> last_run{};
  const auto timer = node.create_wall_timer(kPeriod, [&] {
    last_run = Clock::now();
    ++runs;
  });
  const auto executor = make();
  executor->add_node(node);
  const auto spin_until = [&](int enough) {
    Spinning spinning{*executor};
    ASSERT_TRUE(eventually([&] { return runs >= enough; }));
    spinning.cancel_and_wait();
  };
  spin_until(1);
  std::this_thread::sleep_for(2 * kPeriod);
  const auto reset_after = Clock::now();
  const int before = runs;
  timer->reset();
  spin_until(before + 1);
  EXPECT_GE(last_run.load() - reset_after, kPeriod);
}

TEST_P(Triggers, StopATimerBeforeItIsServed) {
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; });
  timer->cancel();
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  let_others_run();
  EXPECT_EQ(runs, 0);
  timer->reset();
  EXPECT_TRUE(eventually([&] { return runs > 2; }));
}

TEST_P(Triggers, LetAOneShotTimerExpireOnceForEachStart) {
  std::atomic<int> runs{0};
  const auto timer = node.create_one_shot_timer(1ms, [&] { ++runs; });
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  for (int round = 1; round <= 5; ++round) {
    ASSERT_TRUE(eventually([&] { return runs == round; }));
    let_others_run();
    EXPECT_EQ(runs, round);
    timer->reset();  // nothing but this wakes who serves it
  }
}

TEST_P(Triggers, LetAOneShotTimerStartItself) {
  std::atomic<int> runs{0};
  std::shared_ptr<Timer> timer;
  timer = node.create_one_shot_timer(1ms, [&] {
    if (++runs < 5) timer->reset();
  });
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  EXPECT_TRUE(eventually([&] { return runs == 5; }));
  let_others_run();
  EXPECT_EQ(runs, 5);
}

GuardCondition* signalled = nullptr;

TEST(GuardConditionSignal, MayTriggerFromASignalHandler) {
  Context context{private_options()};
  Node node{context, "node"};
  std::atomic<int> runs{0};
  const auto guard_condition = node.create_guard_condition("signal", [&] { ++runs; });
  signalled = guard_condition.get();
  struct sigaction action {};
  struct sigaction before {};
  action.sa_handler = [](int) { signalled->trigger(); };
  ASSERT_EQ(sigaction(SIGUSR2, &action, &before), 0);
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  {
    const Spinning spinning{executor};
    for (int i = 1; i <= 20; ++i) {
      raise(SIGUSR2);
      EXPECT_TRUE(eventually([&] { return runs == i; }));
    }
  }
  sigaction(SIGUSR2, &before, nullptr);
}

TEST(TriggerNames, AreThoseOfTheContract) {
  Context context{private_options()};
  Node node{context, "node", "/car"};
  EXPECT_EQ(node.create_guard_condition("camera", [] {})->logical_id(),
            "/car/node@Waitable(camera)");
  EXPECT_EQ(node.create_one_shot_timer(5ms, [] {})->logical_id(), "/car/node@Timer(5000000)");
  EXPECT_EQ(node.create_one_shot_timer(6ms, [] {})->period(), 6ms);
  EXPECT_THROW((void)node.create_guard_condition("", [] {}), std::invalid_argument);
  EXPECT_THROW((void)node.create_guard_condition("a b", [] {}), std::invalid_argument);
  EXPECT_THROW((void)node.create_one_shot_timer(0ns, [] {}), std::invalid_argument);
}

}  // namespace
}  // namespace cie::test
