#include <cie/scheduling/wakeup.hpp>

#include <atomic>
#include <csignal>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

TEST(Wakeup, KeepsASignalThatCameBefore) {
  Wakeup wakeup;
  wakeup.notify();
  EXPECT_EQ(wakeup.wait_until(kNever), WaitResult::not_waited);
}

TEST(Wakeup, MakesSeveralSignalsOne) {
  Wakeup wakeup;
  wakeup.notify();
  wakeup.notify();
  EXPECT_EQ(wakeup.wait_until(kNever), WaitResult::not_waited);
  EXPECT_EQ(wakeup.wait_until(monotonic_now()), WaitResult::timeout);
}

TEST(Wakeup, TimesOutAtAnInstantThatHasPassed) {
  Wakeup wakeup;
  EXPECT_EQ(wakeup.wait_until(1), WaitResult::timeout);
}

TEST(Wakeup, NeverReturnsBeforeItsDeadlineWithoutASignal) {
  Wakeup wakeup;
  const std::int64_t deadline = monotonic_now() + 2'000'000;
  EXPECT_EQ(wakeup.wait_until(deadline), WaitResult::timeout);
  EXPECT_GE(monotonic_now(), deadline);
}

TEST(Wakeup, WakesAThreadThatWaits) {
  Wakeup wakeup;
  std::atomic<WaitResult> result{WaitResult::spurious};
  std::thread waiter{[&] {
    WaitResult last = WaitResult::spurious;
    while (last == WaitResult::spurious)
      last = wakeup.wait_until(kNever);
    result = last;
  }};
  wakeup.notify();
  waiter.join();
  EXPECT_TRUE(result == WaitResult::signalled || result == WaitResult::not_waited);
}

// The pattern of every dispatch: make ready, notify; take all, wait. No item may be left behind by
// a thread that sleeps. A lost wake-up hangs this test.
TEST(Wakeup, LosesNoSignalBetweenThreads) {
  constexpr int kItems = 20000;
  constexpr int kProducers = 3;
  Wakeup wakeup;
  std::atomic<int> ready{0};
  std::vector<std::thread> producers;
  for (int p = 0; p < kProducers; ++p) {
    producers.emplace_back([&] {
      for (int i = 0; i < kItems; ++i) {
        ready.fetch_add(1, std::memory_order_relaxed);
        wakeup.notify();
      }
    });
  }
  int taken = 0;
  while (taken < kItems * kProducers) {
    taken += ready.exchange(0, std::memory_order_relaxed);
    if (taken < kItems * kProducers) wakeup.wait_until(kNever);
  }
  for (auto& producer : producers)
    producer.join();
  EXPECT_EQ(taken, kItems * kProducers);
}

// What the notifier wrote before is visible after, also when nobody had to be woken: plain data, so
// that the thread sanitizer judges it.
TEST(Wakeup, OrdersMemory) {
  constexpr int kRounds = 5000;
  Wakeup there;
  Wakeup back;
  int data = 0;
  std::thread other{[&] {
    for (int i = 0; i < kRounds; ++i) {
      while (there.wait_until(kNever) == WaitResult::spurious) {
      }
      ++data;
      back.notify();
    }
  }};
  for (int i = 0; i < kRounds; ++i) {
    ++data;
    there.notify();
    while (back.wait_until(kNever) == WaitResult::spurious) {
    }
  }
  other.join();
  EXPECT_EQ(data, 2 * kRounds);
}

Wakeup* target = nullptr;

TEST(Wakeup, MayBeNotifiedByASignalHandler) {
  Wakeup wakeup;
  target = &wakeup;
  struct sigaction action {};
  struct sigaction before {};
  action.sa_handler = [](int) { target->notify(); };
  ASSERT_EQ(sigaction(SIGUSR1, &action, &before), 0);
  raise(SIGUSR1);
  EXPECT_EQ(wakeup.wait_until(kNever), WaitResult::not_waited);
  sigaction(SIGUSR1, &before, nullptr);
}

}  // namespace
}  // namespace cie::scheduling
