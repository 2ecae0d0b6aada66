#include <cie/scheduling/spawned_threads.hpp>
#include <cie/scheduling/team.hpp>
#include <cie/scheduling/threads.hpp>

#include "loop_support.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <pthread.h>

namespace cie::scheduling {
namespace {

// A body of two threads that run until they are stopped.
class TeamTest : public testing::Test {
 protected:
  TeamBody body() {
    return {.run =
                [this] {
                  ++running;
                  while (!is_stopped)
                    std::this_thread::yield();
                },
            .stop = [this] { is_stopped = true; }};
  }
  const std::vector<ThreadPlan> plans{{.role = ThreadRole::pool, .name = "one"},
                                      {.role = ThreadRole::pool, .name = "two"}};
  ExecutorOptions options;
  ThreadConfigurator configurator{options};
  std::atomic<int> running{0};
  std::atomic<bool> is_stopped{false};
};

TEST_F(TeamTest, RunsItsBodyOnEachThreadBehindTheGate) {
  Team team{body(), plans, configurator};
  EXPECT_TRUE(team.wait_configured().empty());
  EXPECT_EQ(running, 0);
  team.open_gate();
  wait_for(running, 2);
  team.stop();
  team.join();
}

TEST_F(TeamTest, LeavesWithoutItsBodyWhenTheGateNeverOpens) {
  { Team team{body(), plans, configurator}; }
  EXPECT_EQ(running, 0);
}

// The thread comes by its parameters before the body runs.
TEST_F(TeamTest, IsConfiguredByItsNames) {
  options.spec = std::make_shared<SchedulingSpec>(SchedulingSpec::parse(
      "non_ros_threads:\n  - {name: two, policy: SCHED_OTHER, affinity: [1023]}\n", "spec.yaml"));
  ThreadConfigurator by_spec{options};
  Team team{body(), plans, by_spec};
  const auto problems = team.wait_configured();
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0].thread, "two");
  EXPECT_THROW(by_spec.refuse_if_any(problems), SchedulingRefused);
}

// A signal to the process is none of theirs: it would run its handler on a callback's priority, and
// cut its system calls short. What a thread does wrong itself, and what counts its time, is.
TEST_F(TeamTest, TakesNoSignalsThatAreForTheProcess) {
  sigset_t before;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  sigset_t blocked;
  sigemptyset(&blocked);
  {
    Team team{{.run = [&] { pthread_sigmask(SIG_SETMASK, nullptr, &blocked); }, .stop = [] {}},
              {plans.front()},
              configurator};
    team.wait_configured();
    team.open_gate();
    team.join();
  }
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM, SIGCHLD})
    EXPECT_EQ(sigismember(&blocked, signal), 1) << strsignal(signal);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS, SIGABRT, SIGPROF})
    EXPECT_EQ(sigismember(&blocked, signal), 0) << strsignal(signal);
  sigset_t after;
  pthread_sigmask(SIG_SETMASK, nullptr, &after);
  for (int signal = 1; signal < SIGRTMIN; ++signal)
    EXPECT_EQ(sigismember(&after, signal), sigismember(&before, signal)) << strsignal(signal);
}

// How many mappings are as large as a thread's stack.
std::size_t stacks() {
  pthread_attr_t attributes{};
  pthread_attr_init(&attributes);
  std::size_t size = 0;
  pthread_attr_getstacksize(&attributes, &size);
  pthread_attr_destroy(&attributes);
  constexpr std::size_t kGuard = 64UL * 1024;  // at most, of it or beside it
  std::ifstream maps{"/proc/self/maps"};
  std::size_t count = 0;
  for (std::string line; std::getline(maps, line);) {
    std::size_t parsed = 0;
    const std::size_t begin = std::stoull(line, &parsed, 16);
    const std::size_t length = std::stoull(line.substr(parsed + 1), nullptr, 16) - begin;
    if (length + kGuard >= size && length <= size + kGuard) ++count;
  }
  return count;
}

class SpawnedThreadsTest : public testing::Test {
 protected:
  ~SpawnedThreadsTest() override { threads.end(); }
  ExecutorOptions options;
  ThreadConfigurator configurator{options};
  NoFailures failures;
  SpawnedThreads threads{configurator, failures};
};

TEST_F(SpawnedThreadsTest, RunUnderTheirNamesUntilTheyAreAskedToStop) {
  std::string name;
  threads.start("pump", [&name](const std::stop_token& stop) {
    name = thread_name(current_tid());
    while (!stop.stop_requested())
      std::this_thread::yield();
  });
  threads.end();
  EXPECT_EQ(name, "pump");
  EXPECT_THROW(threads.start("late", [](const std::stop_token&) {}), std::logic_error);
}

// glibc keeps a few stacks of threads that were joined.
TEST_F(SpawnedThreadsTest, LeaveNoStackBehindWhenTheyReturn) {
  constexpr int kThreads = 60;
  constexpr std::size_t kKept = 20;
  const std::size_t before = stacks();
  std::atomic<int> ends{0};
  for (int i = 0; i < kThreads; ++i) {
    threads.start("brief", [&ends](const std::stop_token&) { ++ends; });
    wait_for(ends, i + 1);
  }
  std::size_t after = stacks();
  for (int look = 0; look < 1000 && after > before + kKept; ++look) {  // the last ones are leaving
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
    after = stacks();
  }
  EXPECT_LE(after, before + kKept);
}

// What the function holds goes with it, and not with the executor.
TEST_F(SpawnedThreadsTest, LetGoOfTheirFunctionWhenItReturns) {
  auto held = std::make_shared<int>(1);
  const std::weak_ptr<int> watch = held;
  threads.start("brief", [held = std::move(held)](const std::stop_token&) {});
  for (int look = 0; look < 5000 && !watch.expired(); ++look)
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  EXPECT_TRUE(watch.expired());
}

TEST_F(SpawnedThreadsTest, TellWhatTheyThrow) {
  threads.start("pump", [](const std::stop_token&) { throw std::runtime_error{"dry"}; });
  wait_for(failures.count, 1);
}

TEST_F(SpawnedThreadsTest, HaveNamesThatTheKernelTakesWhole) {
  for (const char* const name : {"", "sixteen letters!", "tab\t"})
    EXPECT_THROW(threads.start(name, [](const std::stop_token&) {}), std::invalid_argument);
}

}  // namespace
}  // namespace cie::scheduling
