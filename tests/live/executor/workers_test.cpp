// Threads outside DDS: named, configured, stopped and joined like the others.
#include "executors.hpp"
#include "support.hpp"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>

namespace cie::test {
namespace {

using testing::HasSubstr;

std::string own_name() {
  std::ifstream file{"/proc/thread-self/comm"};
  std::string name;
  std::getline(file, name);
  return name;
}

ExecutorOptions with_spec(const std::string& text) {
  ExecutorOptions options;
  options.spec = std::make_shared<SchedulingSpec>(SchedulingSpec::parse(text, "test.yaml"));
  return options;
}

// No machine has CPU 1000 for us: the request is refused whatever we may do.
constexpr const char* kImpossible =
    "non_ros_threads:\n  - id: pump\n    affinity: [1000]\n    policy: SCHED_OTHER\n";

class Workers : public testing::TestWithParam<Kind> {
 protected:
  std::unique_ptr<Executor> make(ExecutorOptions options = {}) {
    return test::make(GetParam(), std::move(options));
  }
};

INSTANTIATE_TEST_SUITE_P(Executors, Workers, every_executor(), name_of);

TEST_P(Workers, RunUnderTheirNamesUntilTheExecutorGoes) {
  const auto idle = make();  // the tracer's own thread comes with the first executor
  const std::size_t before = settled(thread_count);
  std::atomic<int> ended{0};
  std::string name;
  std::atomic<bool> has_run{false};
  {
    const auto executor = make();
    executor->spawn_thread("pump", [&](const std::stop_token& stop) {
      name = own_name();
      has_run = true;
      while (!stop.stop_requested())
        std::this_thread::sleep_for(1ms);
      ++ended;
    });
    executor->spawn_thread("short", [&] { ++ended; });
    EXPECT_TRUE(eventually([&] { return has_run && ended == 1; }));
    executor->spin_for(5ms);
    EXPECT_EQ(ended, 1);  // they outlast a spin
  }
  EXPECT_EQ(ended, 2);
  EXPECT_EQ(name, "pump");
  EXPECT_EQ(settled(thread_count), before);
}

TEST_P(Workers, AreConfiguredBeforeTheyRun) {
  int policy = -1;
  int nice = -1;
  {
    const auto executor =
        make(with_spec("non_ros_threads:\n  - id: pump\n    policy: SCHED_BATCH\n    nice: 7\n"));
    executor->spawn_thread("pump", [&] {
      policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
      nice = getpriority(PRIO_PROCESS, 0);
    });
    EXPECT_TRUE(executor->scheduling_problems().empty());
  }
  EXPECT_EQ(policy, SCHED_BATCH);
  EXPECT_EQ(nice, 7);
}

TEST_P(Workers, NeverRunWhenTheirParametersAreRefused) {
  const auto idle = make();
  const std::size_t before = settled(thread_count);
  std::atomic<bool> has_run{false};
  const auto executor = make(with_spec(kImpossible));
  try {
    executor->spawn_thread("pump", [&] { has_run = true; });
    FAIL() << "nothing was refused";
  } catch (const SchedulingRefused& refused) {
    ASSERT_EQ(refused.problems().size(), 1U);
    EXPECT_EQ(refused.problems().front().entry, "pump");
    EXPECT_EQ(refused.problems().front().thread, "pump");
    EXPECT_EQ(refused.problems().front().line, 2);
    EXPECT_THAT(refused.what(), HasSubstr("test.yaml:2"));
  }
  EXPECT_FALSE(has_run);
  EXPECT_EQ(settled(thread_count), before);
}

TEST_P(Workers, RunAllTheSameWhenAWarningIsEnough) {
  std::atomic<int> warnings{0};
  std::atomic<bool> has_run{false};
  ExecutorOptions options = with_spec(kImpossible);
  options.on_error = OnError::warn;
  options.on_scheduling_problem = [&](const SchedulingProblem&) { ++warnings; };
  {
    const auto executor = make(options);
    executor->spawn_thread("pump", [&] { has_run = true; });
    EXPECT_EQ(executor->scheduling_problems().size(), 1U);
  }
  EXPECT_TRUE(has_run);
  EXPECT_EQ(warnings, 1);
}

TEST_P(Workers, EndASpinByWhatTheyThrow) {
  const auto executor = make();
  executor->spawn_thread("pump", [] { throw std::runtime_error{"no more water"}; });
  try {
    executor->spin();
    FAIL() << "spin() returned";
  } catch (const CallbackError& error) {
    EXPECT_STREQ(error.what(), "thread \"pump\" threw: no more water");
    EXPECT_THROW(error.rethrow_nested(), std::runtime_error);
  }
}

TEST_P(Workers, GiveTheirFailuresToTheHandler) {
  std::string id;
  CallbackId callback{};
  ExecutorOptions options;
  options.on_exception = [&](const CallbackFailure& failure) {
    id = failure.logical_id;
    callback = failure.callback;
  };
  {
    const auto executor = make(options);
    executor->spawn_thread("pump", [] { throw 1; });
  }
  EXPECT_EQ(id, "pump");
  EXPECT_EQ(callback, kNoCallback);
}

TEST_P(Workers, MayStartOthers) {
  std::atomic<int> runs{0};
  {
    const auto executor = make();
    std::atomic<bool> has_started{false};
    executor->spawn_thread("outer", [&] {
      executor->spawn_thread("inner", [&] { ++runs; });
      has_started = true;
    });
    EXPECT_TRUE(eventually([&] { return has_started.load(); }));
  }
  EXPECT_EQ(runs, 1);
}

TEST_P(Workers, RefuseANameThatTheKernelCannotShow) {
  const auto executor = make();
  for (const std::string& name : {std::string{}, std::string(16, 'x'), std::string{"a\nb"}}) {
    EXPECT_THROW(executor->spawn_thread(name, [] {}), std::invalid_argument) << name;
  }
}

}  // namespace
}  // namespace cie::test
