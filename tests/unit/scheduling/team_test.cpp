#include <cie/scheduling/spawned_threads.hpp>
#include <cie/scheduling/team.hpp>
#include <cie/scheduling/threads.hpp>

#include "loop_support.hpp"

#include <atomic>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

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
