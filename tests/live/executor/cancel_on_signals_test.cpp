// SIGINT and SIGTERM end spinning, for as long as a CancelOnSignals lives.
#include <cie/executor/cancel_on_signals.hpp>

#include "executors.hpp"
#include "support.hpp"

#include <array>
#include <atomic>
#include <csignal>
#include <memory>
#include <optional>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::test {
namespace {

struct sigaction handler_of(int signal) {
  struct sigaction action {};
  sigaction(signal, nullptr, &action);
  return action;
}

class CancelsOnSignals : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Executor, CancelsOnSignals, every_executor(), name_of);

TEST_P(CancelsOnSignals, BothSignalsEndSpinning) {
  const auto executor = make(GetParam());
  const CancelOnSignals signals{*executor};
  for (const int signal : {SIGINT, SIGTERM}) {
    Spinning spinning{*executor};
    kill(getpid(), signal);
    EXPECT_TRUE(eventually([&] { return spinning.is_done(); }));
    spinning.wait();
  }
}

TEST(CancelOnSignals, ASignalBeforeSpinIsRemembered) {
  CancelOnSignals signals;
  EXPECT_FALSE(signals.is_requested());
  raise(SIGTERM);
  EXPECT_TRUE(signals.is_requested());
  CallbackIsolatedExecutor executor;
  signals.add(executor);
  executor.spin();
}

TEST(CancelOnSignals, ReachesAllExecutorsOfAll) {
  CallbackIsolatedExecutor first;
  SingleThreadedExecutor second;
  EventsExecutor third;
  CancelOnSignals two{first};
  two.add(second);
  const CancelOnSignals one{third};
  Spinning a{first};
  Spinning b{second};
  Spinning c{third};
  kill(getpid(), SIGINT);
  EXPECT_TRUE(eventually([&] { return a.is_done() && b.is_done() && c.is_done(); }));
}

TEST(CancelOnSignals, AnExecutorMayGoFirst) {
  CancelOnSignals signals;
  {
    CallbackIsolatedExecutor executor;
    signals.add(executor);
  }
  raise(SIGINT);
  EXPECT_TRUE(signals.is_requested());
}

TEST(CancelOnSignals, TheLastPutsTheFormerHandlersBack) {
  struct sigaction own {};
  own.sa_handler = [](int) {};
  struct sigaction before {};
  sigaction(SIGINT, &own, &before);
  auto first = std::make_unique<CancelOnSignals>();
  auto second = std::make_unique<CancelOnSignals>();
  EXPECT_NE(handler_of(SIGINT).sa_handler, own.sa_handler);
  first.reset();  // in whatever order
  EXPECT_NE(handler_of(SIGINT).sa_handler, own.sa_handler);
  raise(SIGINT);
  EXPECT_TRUE(second->is_requested());
  second.reset();
  EXPECT_EQ(handler_of(SIGINT).sa_handler, own.sa_handler);
  EXPECT_EQ(handler_of(SIGTERM).sa_handler, SIG_DFL);
  EXPECT_FALSE(CancelOnSignals{}.is_requested());  // a new beginning
  sigaction(SIGINT, &before, nullptr);
}

TEST(CancelOnSignals, ComesAndGoesWhileSignalsCome) {
  const CancelOnSignals guard;  // the process lives on between two of the others
  std::atomic<bool> is_over{false};
  std::thread sender{[&] {
    while (!is_over)
      kill(getpid(), SIGINT);
  }};
  for (int round = 0; round < 300; ++round) {
    CallbackIsolatedExecutor executor;
    const CancelOnSignals signals{executor};
  }
  is_over = true;
  sender.join();
}

}  // namespace
}  // namespace cie::test
