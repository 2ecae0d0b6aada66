#include "dispatch/calls_in_progress.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>

namespace cie::executor {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

TEST(CallsInProgress, NoneIsWaitedForWithoutSleeping) {
  CallsInProgress calls;
  calls.enter();
  calls.leave();
  calls.wait_for_none();
}

TEST(CallsInProgress, TheLastOneEndsTheWait) {
  CallsInProgress calls;
  std::atomic<bool> is_over{false};
  calls.enter();
  calls.enter();
  std::thread waiter{[&] {
    calls.wait_for_none();
    is_over = true;
  }};
  calls.leave();
  std::this_thread::sleep_for(5ms);
  EXPECT_FALSE(is_over);
  calls.leave();
  waiter.join();
}

// A sleep that is taken up again after each of them never ends.
TEST(CallsInProgress, TheWaitEndsWhileSignalsCome) {
  struct sigaction ignoring {};
  ignoring.sa_handler = [](int) {};
  struct sigaction before {};
  sigaction(SIGUSR1, &ignoring, &before);
  CallsInProgress calls;
  std::atomic<bool> is_over{false};
  calls.enter();
  std::thread waiter{[&] {
    calls.wait_for_none();
    is_over = true;
  }};
  const auto begin = steady_clock::now();
  const auto signals_until = [&](auto is_enough) {
    while (!is_enough() && steady_clock::now() - begin < 10s)
      pthread_kill(waiter.native_handle(), SIGUSR1);
  };
  signals_until([&] { return steady_clock::now() - begin > 20ms; });
  calls.leave();
  signals_until([&] { return is_over.load(); });
  EXPECT_LT(steady_clock::now() - begin, 10s);
  waiter.join();
  sigaction(SIGUSR1, &before, nullptr);
}

}  // namespace
}  // namespace cie::executor
