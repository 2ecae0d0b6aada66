// Threads run as the spec says, or it is said in words why not.
#include "support.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Asked of the kernel here, by another way than the executor's own.
struct KernelView {
  int policy = -1;
  bool resets_on_fork = false;
  int priority = -1;
  int nice = 99;
  std::uint64_t runtime = 0;
  std::uint64_t deadline = 0;
  std::uint64_t period = 0;
  std::set<int> cpus;
};

KernelView ask_kernel() {
  KernelView view;
  const int raw = sched_getscheduler(0);
  view.policy = raw & ~SCHED_RESET_ON_FORK;
  view.resets_on_fork = (raw & SCHED_RESET_ON_FORK) != 0;
  sched_param parameter{};
  sched_getparam(0, &parameter);
  view.priority = parameter.sched_priority;
  // Field 19 of stat, counted behind the name, is the nice value.
  std::ifstream file{"/proc/thread-self/stat"};
  std::string text;
  std::getline(file, text);
  std::istringstream fields{text.substr(text.rfind(')') + 2)};
  for (int field = 3; field < 19; ++field)
    fields >> text;
  fields >> view.nice;
  struct {
    std::uint32_t size;
    std::uint32_t policy;
    std::uint64_t flags;
    std::int32_t nice;
    std::uint32_t priority;
    std::uint64_t runtime;
    std::uint64_t deadline;
    std::uint64_t period;
    std::uint64_t clamp;
  } attributes{};
  syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0);
  if (view.policy == 6) {
    view.runtime = attributes.runtime;
    view.deadline = attributes.deadline;
    view.period = attributes.period;
  }
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof set, &set);
  for (unsigned cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) view.cpus.insert(static_cast<int>(cpu));
  }
  return view;
}

// What the kernel says within the first instance of a timer of this node under this entry.
KernelView view_under(const std::string& entry) {
  const std::string text = "callback_groups:\n  - id: /params/node@Timer(1000000)\n" + entry;
  ExecutorOptions options;
  options.spec = std::make_shared<SchedulingSpec>(SchedulingSpec::parse(text, "test.yaml"));
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options};
  Node node{context, "node", "/params"};
  KernelView view;
  const auto timer = node.create_wall_timer(1ms, [&] {
    view = ask_kernel();
    executor.cancel();
  });
  executor.add_node(node);
  executor.spin_for(20s);
  return view;
}

// Their ids differ by the order of creation only, and again so when the node comes a second time.
TEST(Parameters, OfTimersOfEqualPeriodAreEachTheirOwn) {
  ExecutorOptions options;
  options.spec = std::make_shared<SchedulingSpec>(SchedulingSpec::parse(R"(
callback_groups:
  - {id: /twins/node@Timer(1000000), policy: SCHED_OTHER, nice: 3}
  - {id: /twins/node@Timer(1000000)#2, policy: SCHED_OTHER, nice: 5}
  - {id: /twins/node@Timer(1000000)#3, policy: SCHED_BATCH, nice: 7}
)",
                                                                        "test.yaml"));
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options};
  const Spinning spinning{executor};
  for (int lifetime = 0; lifetime < 2; ++lifetime) {
    Node node{context, "node", "/twins"};
    std::array<KernelView, 3> views;
    std::atomic<int> seen{0};
    std::vector<std::shared_ptr<Timer>> timers;
    for (KernelView& view : views) {
      timers.push_back(node.create_one_shot_timer(1ms, [&] {
        view = ask_kernel();
        ++seen;
      }));
    }
    executor.add_node(node);
    ASSERT_TRUE(eventually([&] { return seen == 3; }));
    executor.remove_node(node);
    EXPECT_EQ((std::array{views[0].nice, views[1].nice, views[2].nice}), (std::array{3, 5, 7}));
    EXPECT_EQ(views[2].policy, SCHED_BATCH);
  }
}

// Whether this process may use real-time policies here.
std::string why_not_privileged() {
  const sched_param parameter{.sched_priority = 1};
  sched_param before{};
  sched_getparam(0, &before);
  if (sched_setscheduler(0, SCHED_FIFO, &parameter) != 0) {
    return "not possible here: needs CAP_SYS_NICE and a real-time budget: " +
           std::string{std::strerror(errno)};
  }
  sched_setscheduler(0, SCHED_OTHER, &before);
  return {};
}

class Privileged : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = why_not_privileged(); !why.empty()) GTEST_SKIP() << why;
  }
};

TEST(Parameters, OtherWithNice) {
  const auto view = view_under("    policy: SCHED_OTHER\n    nice: 7\n");
  EXPECT_EQ(view.policy, SCHED_OTHER);
  EXPECT_EQ(view.nice, 7);
}

TEST(Parameters, Batch) {
  const auto view = view_under("    policy: SCHED_BATCH\n    nice: 3\n");
  EXPECT_EQ(view.policy, SCHED_BATCH);
  EXPECT_EQ(view.nice, 3);
}

TEST(Parameters, Idle) { EXPECT_EQ(view_under("    policy: SCHED_IDLE\n").policy, SCHED_IDLE); }

TEST_F(Privileged, Fifo) {
  const auto view = view_under("    policy: SCHED_FIFO\n    priority: 12\n");
  EXPECT_EQ(view.policy, SCHED_FIFO);
  EXPECT_EQ(view.priority, 12);
  EXPECT_TRUE(view.resets_on_fork);
}

TEST_F(Privileged, RoundRobin) {
  const auto view = view_under("    policy: SCHED_RR\n    priority: 13\n");
  EXPECT_EQ(view.policy, SCHED_RR);
  EXPECT_EQ(view.priority, 13);
}

TEST_F(Privileged, Deadline) {
  const auto view = view_under(
      "    policy: SCHED_DEADLINE\n    runtime: 200000\n    deadline: 5000000\n"
      "    period: 10000000\n");
  EXPECT_EQ(view.policy, 6);
  EXPECT_EQ(view.runtime, 200000U);
  EXPECT_EQ(view.deadline, 5000000U);
  EXPECT_EQ(view.period, 10000000U);
  EXPECT_TRUE(view.resets_on_fork);
}

// Cpusets that this process has left behind.
int own_cpusets() {
  int count = 0;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry{"/sys/fs/cgroup", error}, end;
       !error && entry != end; entry.increment(error)) {
    const std::string prefix = "cie-" + std::to_string(getpid()) + "-";
    count += entry->path().filename().string().starts_with(prefix) ? 1 : 0;
  }
  return count;
}

TEST_F(Privileged, DeadlineOnOneCpuHasACpusetOfItsOwn) {
  const auto all = ask_kernel().cpus;
  if (all.size() < 2) GTEST_SKIP() << "not possible here: there is one CPU only";
  const int cpu = *all.rbegin();
  const std::string entry =
      "    policy: SCHED_DEADLINE\n    runtime: 200000\n    deadline: 5000000\n"
      "    period: 10000000\n    affinity: [" +
      std::to_string(cpu) + "]\n";
  try {
    view_under(entry);
    ADD_FAILURE() << "the kernel took the affinity without a cpuset";
  } catch (const SchedulingRefused& refused) {
    EXPECT_THAT(refused.what(), HasSubstr("`cpuset: exclusive`"));
  }
  try {
    const auto view = view_under(entry + "    cpuset: exclusive\n");
    EXPECT_EQ(view.policy, 6);
    EXPECT_EQ(view.cpus, std::set<int>{cpu});
    EXPECT_EQ(own_cpusets(), 0) << "they go with the executor";
  } catch (const SchedulingRefused& refused) {
    EXPECT_EQ(own_cpusets(), 0);
    GTEST_SKIP() << "not possible here: " << refused.what();
  }
}

TEST(Parameters, Affinity) {
  const auto all = ask_kernel().cpus;
  const int cpu = *all.rbegin();
  const auto view = view_under("    affinity: [" + std::to_string(cpu) + "]\n");
  EXPECT_EQ(view.cpus, std::set<int>{cpu});
}

ExecutorOptions options_for(const std::string& text, OnError on_error) {
  ExecutorOptions options;
  options.spec = std::make_shared<SchedulingSpec>(SchedulingSpec::parse(text, "robot.yaml"));
  options.on_error = on_error;
  return options;
}

// An entry that no kernel can follow.
std::string impossible(const std::string& name_space) {
  return "callback_groups:\n  - id: " + name_space + "/node@Timer(1000000)\n    affinity: [1023]\n";
}

TEST(Refused, StopsBeforeAnyCallbackRuns) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options_for(impossible("/refused0"), OnError::refuse)};
  Node node{context, "node", "/refused0"};
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; }, {.phase = 0ns});
  const auto second_timer =
      node.create_wall_timer(2ms, [&] { ++runs; }, {.phase = 0ns});  // its own parameters are fine
  executor.add_node(node);
  try {
    executor.spin_for(20s);
    FAIL() << "nothing was refused";
  } catch (const SchedulingRefused& refused) {
    ASSERT_EQ(refused.problems().size(), 1U);
    const SchedulingProblem& problem = refused.problems().front();
    EXPECT_EQ(problem.file, "robot.yaml");
    EXPECT_EQ(problem.line, 2);
    EXPECT_EQ(problem.entry, "/refused0/node@Timer(1000000)");
    EXPECT_EQ(problem.error, EINVAL);
    EXPECT_THAT(std::string{refused.what()}, HasSubstr("robot.yaml:2: "));
    EXPECT_THAT(std::string{refused.what()}, HasSubstr("cannot set CPUs 1023"));
  }
  EXPECT_EQ(runs, 0);
  EXPECT_FALSE(executor.is_spinning());
}

TEST(Refused, RefusesANodeThatIsAddedLater) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options_for(impossible("/refused1"), OnError::refuse)};
  Node served{context, "served", "/refused1"};
  std::atomic<bool> serves{false};
  const auto serving = served.create_wall_timer(1ms, [&] { serves = true; });
  executor.add_node(served);
  Spinning spinning{executor};
  ASSERT_TRUE(eventually([&] { return serves.load(); })) << "before that it would be no later node";
  Node node{context, "node", "/refused1"};
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; }, {.phase = 0ns});
  EXPECT_THROW(executor.add_node(node), SchedulingRefused);
  EXPECT_THROW(executor.remove_node(node), std::logic_error) << "it is not a member";
  spinning.cancel_and_wait();
  EXPECT_EQ(runs, 0);
}

TEST(Refused, IsAWarningIfYouLike) {
  std::vector<std::string> told;
  auto options = options_for(impossible("/refused2"), OnError::warn);
  options.on_scheduling_problem = [&](const SchedulingProblem& problem) {
    told.push_back(problem.entry);
  };
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options};
  Node node{context, "node", "/refused2"};
  const auto timer = node.create_wall_timer(1ms, [&] { executor.cancel(); });
  executor.add_node(node);
  executor.spin_for(20s);
  EXPECT_THAT(told, ElementsAre("/refused2/node@Timer(1000000)"));
  EXPECT_EQ(executor.scheduling_problems().size(), 1U);
}

TEST(Refused, AreTwoWishesForTheThreadOfAGroup) {
  constexpr const char* kText =
      "callback_groups:\n"
      "  - id: /torn/node@Timer(1000000)\n"
      "    policy: SCHED_BATCH\n"
      "    nice: 1\n"
      "  - id: /torn/node@Timer(2000000)\n"
      "    policy: SCHED_BATCH\n"
      "    nice: 2\n";
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options_for(kText, OnError::refuse)};
  Node node{context, "node", "/torn"};
  const auto group = node.create_callback_group(GroupType::mutually_exclusive);
  const auto timer = node.create_wall_timer(1ms, [] {}, {.group = group});
  const auto second_timer = node.create_wall_timer(2ms, [] {}, {.group = group});
  executor.add_node(node);
  try {
    executor.spin_for(20s);
    FAIL() << "nothing was refused";
  } catch (const SchedulingRefused& refused) {
    ASSERT_EQ(refused.problems().size(), 1U);
    EXPECT_EQ(refused.problems().front().line, 5);
    EXPECT_THAT(refused.problems().front().reason, HasSubstr("line 2"));
  }
}

// The thread in spin() has an entry too, by its name; it is asked before any callback runs.
TEST(Refused, MayBeTheThreadThatSpins) {
  constexpr const char* kText =
      "callback_groups: []\n"
      "non_ros_threads:\n"
      "  - id: spinner\n"
      "    affinity: [1023]\n";
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options_for(kText, OnError::refuse)};
  Node node{context, "node"};
  std::atomic<int> runs{0};
  const auto timer = node.create_wall_timer(1ms, [&] { ++runs; }, {.phase = 0ns});
  executor.add_node(node);
  std::thread spinner{[&] {
    pthread_setname_np(pthread_self(), "spinner");
    EXPECT_THROW(executor.spin_for(20s), SchedulingRefused);
  }};
  spinner.join();
  EXPECT_EQ(runs, 0);
}

TEST(Workers, OfDdsAreConfiguredByTheirNames) {
  constexpr const char* kText =
      "callback_groups: []\n"
      "non_ros_threads:\n"
      "  - id: recvUC\n"
      "    policy: SCHED_BATCH\n"
      "    nice: 4\n";
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options_for(kText, OnError::refuse)};
  Node node{context, "node"};
  std::map<std::string, int> policies;
  const auto timer = node.create_wall_timer(1ms, [&] {
    for (const auto& thread : threads_now())
      policies[thread.name] = sched_getscheduler(thread.tid);
    executor.cancel();
  });
  executor.add_node(node);
  executor.spin_for(20s);
  EXPECT_EQ(policies.at("recvUC"), SCHED_BATCH);
  EXPECT_EQ(policies.at("tev"), SCHED_OTHER);
}

}  // namespace
}  // namespace cie::test
