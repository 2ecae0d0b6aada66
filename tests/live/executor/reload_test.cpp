// Parameters change while callbacks run: by a new spec, and behind the executor's back.
#include "support.hpp"

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::shared_ptr<const SchedulingSpec> spec_of(const std::string& entries,
                                              const std::string& threads = "") {
  return std::make_shared<SchedulingSpec>(
      SchedulingSpec::parse("callback_groups:\n" + entries + threads, "spec.yaml"));
}

// A node with two timers that tell their threads.
class Reload : public testing::Test {
 protected:
  // Ids are unique in a process for good, so each test has a namespace of its own.
  Reload() : name_space_("/reload" + std::to_string(++tests)) {}

  std::string id(int timer) const {
    return name_space_ + "/node@Timer(" + std::to_string(timer) + "000000)";
  }
  std::string entry(int timer, const std::string& parameters) const {
    return "  - {id: " + id(timer) + ", " + parameters + "}\n";
  }
  void start(ExecutorOptions options, const std::string& entries) {
    options.spec = spec_of(entries);
    options.on_scheduling_problem = [this](const SchedulingProblem& problem) {
      const std::lock_guard lock{mutex_};
      told_.push_back(problem.text());
    };
    executor_ = std::make_unique<CallbackIsolatedExecutor>(options);
    for (const int timer : {1, 2}) {
      timers_.push_back(node_.create_wall_timer(std::chrono::milliseconds{timer}, [this, timer] {
        tid(timer) = gettid();
        ++runs_;
      }));
    }
    executor_->add_node(node_);
    spinning_ = std::make_unique<Spinning>(*executor_);
    ASSERT_TRUE(eventually([this] { return tid(1) != 0 && tid(2) != 0; }));
  }
  std::atomic<pid_t>& tid(int timer) { return tids_.at(static_cast<std::size_t>(timer)); }
  int policy(int timer) { return sched_getscheduler(tid(timer)) & ~SCHED_RESET_ON_FORK; }
  int nice(int timer) { return getpriority(PRIO_PROCESS, static_cast<id_t>(tid(timer).load())); }
  int cpus(int timer) {
    cpu_set_t set;
    CPU_ZERO(&set);
    sched_getaffinity(tid(timer), sizeof set, &set);
    return CPU_COUNT(&set);
  }
  std::vector<std::string> told() {
    const std::lock_guard lock{mutex_};
    return told_;
  }
  void expect_running() {
    const int before = runs_;
    EXPECT_TRUE(eventually([this, before] { return runs_ > before + 2; }));
  }

  static inline int tests = 0;
  const std::string name_space_;
  Context context_{private_options()};
  Node node_{context_, "node", name_space_};
  std::vector<std::shared_ptr<Timer>> timers_;
  std::array<std::atomic<pid_t>, 3> tids_{};
  std::atomic<int> runs_{0};
  std::mutex mutex_;  // of the next
  std::vector<std::string> told_;
  std::unique_ptr<CallbackIsolatedExecutor> executor_;
  std::unique_ptr<Spinning> spinning_;
};

TEST_F(Reload, ChangesThreadsThatRun) {
  start({}, entry(1, "policy: SCHED_BATCH, nice: 3"));
  EXPECT_EQ(policy(1), SCHED_BATCH);
  EXPECT_EQ(policy(2), SCHED_OTHER);
  const pid_t thread = tid(1);
  executor_->reload_spec(spec_of(entry(1, "policy: SCHED_BATCH, nice: 7") +
                                 entry(2, "policy: SCHED_OTHER, nice: 5, affinity: [0]")));
  EXPECT_EQ(nice(1), 7);
  EXPECT_EQ(nice(2), 5);
  EXPECT_EQ(cpus(2), 1);
  EXPECT_EQ(tid(1), thread) << "no thread is replaced";
  expect_running();
  EXPECT_THAT(told(), IsEmpty());
}

TEST_F(Reload, TakesBackWhatIsNoLongerAskedFor) {
  const int all = [] {
    cpu_set_t set;
    CPU_ZERO(&set);
    sched_getaffinity(0, sizeof set, &set);
    return CPU_COUNT(&set);
  }();
  start({}, entry(1, "policy: SCHED_BATCH, affinity: [0]"));
  executor_->reload_spec(nullptr);
  EXPECT_EQ(policy(1), SCHED_OTHER);
  EXPECT_EQ(cpus(1), all);
}

TEST_F(Reload, ThatIsRefusedLeavesEverythingAsItWas) {
  start({}, entry(1, "policy: SCHED_BATCH"));
  const auto bad = spec_of(entry(1, "policy: SCHED_OTHER, affinity: [0]") +
                           entry(2, "policy: SCHED_BATCH, affinity: [1023]"));
  try {
    executor_->reload_spec(bad);
    FAIL() << "nothing was refused";
  } catch (const SchedulingRefused& refused) {
    ASSERT_EQ(refused.problems().size(), 1U);
    EXPECT_EQ(refused.problems()[0].entry, id(2));
    EXPECT_EQ(refused.problems()[0].line, 3);
  }
  EXPECT_EQ(policy(1), SCHED_BATCH);
  EXPECT_EQ(policy(2), SCHED_OTHER);
  expect_running();
  executor_->reload_spec(spec_of(entry(2, "policy: SCHED_BATCH")));
  EXPECT_EQ(policy(1), SCHED_OTHER);
  EXPECT_EQ(policy(2), SCHED_BATCH);
}

TEST_F(Reload, UnderWarnGoesAsFarAsItCan) {
  ExecutorOptions options;
  options.on_error = OnError::warn;
  start(options, entry(1, "policy: SCHED_OTHER"));
  executor_->reload_spec(spec_of(entry(1, "policy: SCHED_BATCH") + entry(2, "affinity: [1023]")));
  EXPECT_EQ(policy(1), SCHED_BATCH);
  EXPECT_THAT(told(), ElementsAre(HasSubstr("cannot set CPUs 1023")));
}

TEST_F(Reload, IsWhatLaterThreadsRunBy) {
  start({}, entry(1, "policy: SCHED_OTHER"));
  executor_->reload_spec(spec_of(entry(3, "policy: SCHED_BATCH"),
                                 "non_ros_threads:\n  - {id: helper, policy: SCHED_IDLE}\n"));
  // The timer runs on after the test's body has ended.
  const auto of_timer = std::make_shared<std::atomic<int>>(-1);
  const auto of_helper = std::make_shared<std::atomic<int>>(-1);
  const auto timer =
      node_.create_wall_timer(3ms, [of_timer] { *of_timer = sched_getscheduler(0); });
  executor_->spawn_thread("helper", [of_helper] { *of_helper = sched_getscheduler(0); });
  EXPECT_TRUE(eventually([&] { return *of_timer == SCHED_BATCH && *of_helper == SCHED_IDLE; }));
}

TEST_F(Reload, ReachesTheThreadsOfDds) {
  start({}, entry(1, "policy: SCHED_OTHER"));
  executor_->reload_spec(spec_of("", "dds_threads:\n  - {name: recvUC, policy: SCHED_BATCH}\n"));
  int policy = -1;
  for (const auto& thread : threads_now()) {
    if (thread.name == "recvUC") policy = sched_getscheduler(thread.tid);
  }
  EXPECT_EQ(policy, SCHED_BATCH);
}

// Between FIFO and DEADLINE and back, with an affinity that only one of them may have.
TEST_F(Reload, ChangesRealTimePolicies) {
  const sched_param one{.sched_priority = 1};
  if (sched_setscheduler(0, SCHED_FIFO, &one) != 0)
    GTEST_SKIP() << "not possible here: needs CAP_SYS_NICE";
  const sched_param none{};
  sched_setscheduler(0, SCHED_OTHER, &none);
  start({}, entry(1, "policy: SCHED_FIFO, priority: 12"));
  sched_param now{};
  executor_->reload_spec(spec_of(entry(1, "policy: SCHED_FIFO, priority: 14")));
  sched_getparam(tid(1), &now);
  EXPECT_EQ(now.sched_priority, 14);
  executor_->reload_spec(spec_of(
      entry(1, "policy: SCHED_DEADLINE, runtime: 200000, deadline: 10000000, period: 10000000")));
  EXPECT_EQ(policy(1), 6);
  executor_->reload_spec(spec_of(entry(1, "policy: SCHED_RR, priority: 3, affinity: [0]")));
  EXPECT_EQ(policy(1), SCHED_RR);
  EXPECT_EQ(cpus(1), 1);
  expect_running();
}

ExecutorOptions audited(OnChange on_change) {
  ExecutorOptions options;
  options.audit_period = 20ms;
  options.on_change = on_change;
  return options;
}

// To a policy that any user may leave again.
void change_from_outside(pid_t tid) {
  const sched_param none{};
  ASSERT_EQ(sched_setscheduler(tid, SCHED_OTHER, &none), 0);
}

TEST_F(Reload, AnAuditFindsWhatSomebodyElseChangedAndSaysItOnce) {
  start(audited(OnChange::report), entry(1, "policy: SCHED_BATCH"));
  change_from_outside(tid(1));
  ASSERT_TRUE(eventually([this] { return !told().empty(); }));
  std::this_thread::sleep_for(100ms);  // several audits more
  EXPECT_THAT(told(),
              ElementsAre(HasSubstr("changed from outside: policy is SCHED_OTHER instead of "
                                    "SCHED_BATCH")));
  EXPECT_EQ(policy(1), SCHED_OTHER) << "nobody asked to change it back";
}

TEST_F(Reload, AnAuditAppliesAgainIfItMay) {
  start(audited(OnChange::apply_again), entry(1, "policy: SCHED_BATCH"));
  change_from_outside(tid(1));
  EXPECT_TRUE(eventually([this] { return policy(1) == SCHED_BATCH; }));
  ASSERT_TRUE(eventually([this] { return !told().empty(); }));
  EXPECT_THAT(told(), ElementsAre(HasSubstr("; it is applied again")));
}

}  // namespace
}  // namespace cie::test
