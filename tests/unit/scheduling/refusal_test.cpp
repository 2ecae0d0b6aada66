// Each cause of a refusal is named, on machines that are written down here.
#include "scheduling/refusal.hpp"

#include <cie/scheduling/exclusive_cpusets.hpp>

#include "kernel_tree.hpp"

#include <cerrno>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::scheduling {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr const char* kAllCapabilities = "CapEff:\t000001ffffffffff\n";
constexpr const char* kNone = "CapEff:\t0000000000000000\n";
constexpr const char* kLimits =
    "Limit                     Soft Limit           Hard Limit           Units     \n"
    "Max processes             15639                15639                processes \n"
    "Max locked memory         8388608              8388608              bytes     \n"
    "Max nice priority         0                    0                    \n"
    "Max realtime priority     0                    0                    \n";

class Refusal : public KernelTree {
 protected:
  Refusal() {
    write("proc/thread-self/status", std::string{kAllCapabilities} + "Cpus_allowed_list:\t0-3\n");
    write("proc/self/uid_map", "         0          0 4294967295\n");
    write("proc/self/limits", kLimits);
    write("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
    write("proc/sys/kernel/sched_rt_period_us", "1000000\n");
  }
  static ThreadParameters asked(Policy policy) {
    ThreadParameters parameters;
    parameters.policy = policy;
    parameters.priority = 60;
    parameters.runtime_ns = 1'000'000;
    parameters.deadline_ns = 5'000'000;
    parameters.period_ns = 10'000'000;
    return parameters;
  }
  std::string why(int error, const ThreadParameters& parameters) const {
    return why_policy_refused(error, parameters, kernel());
  }
};

TEST_F(Refusal, NamesTheMissingCapabilityAndTheLimitInItsPlace) {
  write("proc/thread-self/status", kNone);
  EXPECT_THAT(why(EPERM, asked(Policy::fifo)),
              AllOf(StartsWith("Operation not permitted (CAP_SYS_NICE is needed"),
                    HasSubstr("RLIMIT_RTPRIO of at least 60 (it is 0)"), HasSubstr("setpriv")));
  auto nice = asked(Policy::other);
  nice.nice = -5;
  EXPECT_THAT(why(EPERM, nice), HasSubstr("RLIMIT_NICE of at least 25 (it is 0)"));
  EXPECT_THAT(why(EPERM, asked(Policy::deadline)),
              AllOf(HasSubstr("CAP_SYS_NICE is needed"), Not(HasSubstr("RLIMIT"))));
}

// As `ulimit` says it: "unlimited".
constexpr const char* kNoLimits =
    "Limit                     Soft Limit           Hard Limit           Units     \n"
    "Max processes             unlimited            unlimited            processes \n"
    "Max locked memory         unlimited            unlimited            bytes     \n"
    "Max nice priority         unlimited            unlimited            \n"
    "Max realtime priority     unlimited            unlimited            \n";

TEST_F(Refusal, NamesNoLimitThatIsHighEnough) {
  write("proc/thread-self/status", kNone);
  write("proc/self/limits", kNoLimits);
  EXPECT_THAT(why(EPERM, asked(Policy::fifo)),
              AllOf(HasSubstr("(RLIMIT_RTPRIO is high enough (it is unlimited): "),
                    HasSubstr("seccomp"), Not(HasSubstr("ulimit -r"))));
  EXPECT_THAT(why(EPERM, asked(Policy::other)),
              AllOf(HasSubstr("(RLIMIT_NICE is high enough (it is unlimited)"),
                    HasSubstr("reset-on-fork"), HasSubstr("setpriv")))
      << "what real-time threads have, and only the capability takes back";
  EXPECT_THAT(why(EPERM, asked(Policy::deadline)), HasSubstr("CAP_SYS_NICE is needed"));
  write("proc/self/limits",
        "Max realtime priority     60                   60                   \n");
  EXPECT_THAT(why(EPERM, asked(Policy::fifo)), HasSubstr("is high enough (it is 60)"));
  write("proc/sys/kernel/sched_rt_runtime_us", "0\n");
  EXPECT_THAT(why(EPERM, asked(Policy::fifo)), HasSubstr("sched_rt_runtime_us is 0"));
}

TEST_F(Refusal, BlamesNoLimitThatThereIsNot) {
  write("proc/thread-self/status", kNone);
  write("proc/self/limits", kNoLimits);
  EXPECT_THAT(why_memory_lock_refused(ENOMEM, kernel()), Not(HasSubstr("RLIMIT_MEMLOCK")));
  EXPECT_THAT(why_no_thread(EAGAIN, kernel()),
              AllOf(HasSubstr("memory for its stack"), Not(HasSubstr("RLIMIT_NPROC"))));
}

TEST_F(Refusal, NamesTheControlGroupWithoutRealTimeBudget) {
  write("proc/thread-self/cgroup", "2:cpu,cpuacct:/robot/app\n1:name=systemd:/\n0::/\n");
  write("proc/self/mountinfo",
        "30 25 0:26 / /sys/fs/cgroup/cpu,cpuacct rw,relatime - cgroup cgroup rw,cpu,cpuacct\n");
  write("sys/fs/cgroup/cpu,cpuacct/robot/app/cpu.rt_runtime_us", "0\n");
  EXPECT_THAT(why(EPERM, asked(Policy::round_robin)),
              AllOf(HasSubstr("no real-time budget"),
                    HasSubstr("/sys/fs/cgroup/cpu,cpuacct/robot/app/cpu.rt_runtime_us")));
  EXPECT_THAT(why(EPERM, asked(Policy::deadline)), Not(HasSubstr("budget")))
      << "groups do not concern it";
  write("sys/fs/cgroup/cpu,cpuacct/robot/app/cpu.rt_runtime_us", "100000\n");
  EXPECT_THAT(why(EPERM, asked(Policy::round_robin)), HasSubstr("seccomp"));
}

TEST_F(Refusal, NamesThrottlingThatLeavesNothing) {
  write("proc/sys/kernel/sched_rt_runtime_us", "0\n");
  for (const Policy policy : {Policy::fifo, Policy::deadline})
    EXPECT_THAT(why(EPERM, asked(policy)), HasSubstr("sched_rt_runtime_us is 0"));
}

TEST_F(Refusal, NamesAUserNamespace) {
  write("proc/self/uid_map", "0 1000 1\n");
  EXPECT_THAT(why(EPERM, asked(Policy::fifo)), HasSubstr("user namespace"));
}

TEST_F(Refusal, OfDeadlineOnSomeCpusNamesTheCpuset) {
  auto pinned = asked(Policy::deadline);
  pinned.cpus = {{1}};
  write("proc/thread-self/status", std::string{kAllCapabilities} + "Cpus_allowed_list:\t1\n");
  EXPECT_THAT(why(EPERM, pinned), AllOf(HasSubstr("CPUs 1:"), HasSubstr("`cpuset: exclusive`")));
  EXPECT_THAT(why(EPERM, asked(Policy::deadline)), HasSubstr("taskset"));
  EXPECT_THAT(why_affinity_refused(EBUSY, kernel()), HasSubstr("`cpuset: exclusive`"));
}

TEST_F(Refusal, NamesAdmissionWithItsNumbers) {
  EXPECT_THAT(why(EBUSY, asked(Policy::deadline)),
              AllOf(StartsWith("Device or resource busy (admission: "),
                    HasSubstr("the 10.0 % of a CPU that it asks for"), HasSubstr("the 95.0 %"),
                    HasSubstr("sched_rt_runtime_us")));
}

TEST_F(Refusal, NamesTheBoundsOfPeriods) {
  write("proc/sys/kernel/sched_deadline_period_min_us", "250\n");
  write("proc/sys/kernel/sched_deadline_period_max_us", "4194304\n");
  EXPECT_THAT(why(EINVAL, asked(Policy::deadline)), HasSubstr("250 us to 4194304 us"));
}

TEST_F(Refusal, NamesAKernelWithoutClamps) {
  auto clamped = asked(Policy::other);
  clamped.util_max = 500;
  for (const int error : {EOPNOTSUPP, E2BIG})
    EXPECT_THAT(why(error, clamped), HasSubstr("CONFIG_UCLAMP_TASK"));
  EXPECT_THAT(why(E2BIG, asked(Policy::other)), Not(HasSubstr("CLAMP")));
}

TEST_F(Refusal, OfCpusSaysWhichThereAre) {
  write("sys/devices/system/cpu/online", "0-3\n");
  write("proc/thread-self/cgroup", "0::/app\n");
  write("proc/self/mountinfo", "30 25 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n");
  write("sys/fs/cgroup/app/cgroup.controllers", "cpuset cpu\n");
  write("sys/fs/cgroup/app/cpuset.cpus.effective", "2-3\n");
  EXPECT_THAT(why_affinity_refused(EINVAL, kernel()),
              AllOf(HasSubstr("online are 0-3"), HasSubstr("cpuset allows 2-3")));
}

TEST_F(Refusal, OfMemoryNamesTheLimit) {
  write("proc/thread-self/status", kNone);
  EXPECT_THAT(why_memory_lock_refused(ENOMEM, kernel()),
              AllOf(StartsWith("Cannot allocate memory ("), HasSubstr("RLIMIT_MEMLOCK"),
                    HasSubstr("8192 kB"), HasSubstr("CAP_IPC_LOCK")));
}

TEST_F(Refusal, OfAThreadNamesWhatIsFull) {
  EXPECT_THAT(why_no_thread(EAGAIN, kernel()),
              AllOf(StartsWith("RLIMIT_NPROC (15639), memory"), HasSubstr("SCHED_DEADLINE")));
  const auto of_user = [](uid_t user, const char* threads) {
    return fmt::format("Name:\tapp\nUid:\t{0}\t{0}\t{0}\t{0}\nThreads:\t{1}\n", user, threads);
  };
  write("proc/100/status", of_user(getuid(), "15000"));
  write("proc/101/status", of_user(getuid() + 1, "9000"));
  EXPECT_THAT(why_no_thread(EAGAIN, kernel()), HasSubstr("memory for its stack"));
  write("proc/102/status", of_user(getuid(), "639"));
  EXPECT_EQ(why_no_thread(EAGAIN, kernel()),
            "this user has 15639 threads, and RLIMIT_NPROC is 15639: raise `ulimit -u`");
  write("proc/thread-self/cgroup", "5:pids:/app\n");
  write("proc/self/mountinfo", "30 25 0:26 / /sys/fs/cgroup/pids rw - cgroup cgroup rw,pids\n");
  write("sys/fs/cgroup/pids/app/pids.max", "20\n");
  write("sys/fs/cgroup/pids/app/pids.current", "20\n");
  EXPECT_THAT(why_no_thread(EAGAIN, kernel()), HasSubstr("pids/app/pids.max"));
}

// A container shows a part of the hierarchy only.
TEST_F(Refusal, FindsTheGroupBelowAMountOfAPart) {
  write("proc/thread-self/cgroup", "2:cpu:/docker/abc/inner\n");
  write("proc/self/mountinfo",
        "30 25 0:26 /docker/abc /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu\n");
  EXPECT_EQ(kernel().group("cpu")->folder, kernel().path("/sys/fs/cgroup/cpu/inner"));
  EXPECT_FALSE(kernel().group("cpuset"));
}

class Cpusets : public KernelTree {
 protected:
  static constexpr std::uint32_t kTid = 77;
  void in_group(const char* folder, const char* mountinfo) {
    write("proc/self/task/77/cgroup", folder);
    write("proc/self/mountinfo", mountinfo);
  }
  std::string text(const std::string& file) const {
    return KernelView::line(kernel().path("/sys/fs/cgroup/" + file)).value_or("");
  }
  std::string own(const char* cpus) const {
    return "cie-" + std::to_string(getpid()) + "-cpus-" + cpus;
  }
};

constexpr const char* kVersion1 =
    "30 25 0:26 / /sys/fs/cgroup/cpuset rw - cgroup cgroup rw,cpuset\n";

TEST_F(Cpusets, OfVersion1AreExclusiveAndHoldTheThread) {
  in_group("3:cpuset:/app\n", kVersion1);
  write("sys/fs/cgroup/cpuset/cpuset.sched_load_balance", "0\n");
  write("sys/fs/cgroup/cpuset/app/cpuset.sched_load_balance", "0\n");
  write("sys/fs/cgroup/cpuset/app/cpuset.mems", "0-1\n");
  ExclusiveCpusets cpusets{kernel()};
  EXPECT_EQ(cpusets.join(kTid, {1, 2}).error, 0);
  const std::string folder = "cpuset/app/" + own("1,2") + "/";
  EXPECT_EQ(text(folder + "cpuset.cpus"), "1,2");
  EXPECT_EQ(text(folder + "cpuset.mems"), "0-1");
  EXPECT_EQ(text(folder + "cpuset.cpu_exclusive"), "1");
  EXPECT_EQ(text(folder + "tasks"), "77");
  // The kernel would now show it there; it goes back when its parameters change.
  in_group(("3:cpuset:/app/" + own("1,2") + "\n").c_str(), kVersion1);
  cpusets.leave(kTid);
  EXPECT_EQ(text("cpuset/app/tasks"), "77");
}

TEST_F(Cpusets, UnderOneThatBalancesLoadAreRefusedAndNotMade) {
  in_group("3:cpuset:/app\n", kVersion1);
  write("sys/fs/cgroup/cpuset/cpuset.sched_load_balance", "1\n");
  write("sys/fs/cgroup/cpuset/app/cpuset.sched_load_balance", "0\n");
  ExclusiveCpusets cpusets{kernel()};
  const SchedRequest outcome = cpusets.join(kTid, {1});
  EXPECT_EQ(outcome.error, EPERM);
  EXPECT_THAT(outcome.reason,
              AllOf(HasSubstr("/sys/fs/cgroup/cpuset/cpuset.sched_load_balance is 1"),
                    HasSubstr("write 0 to it")));
  EXPECT_FALSE(exists(kernel().path("/sys/fs/cgroup/cpuset/app/" + own("1"))));
}

TEST_F(Cpusets, OfVersion2ArePartitions) {
  in_group("0::/app\n", "30 25 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n");
  write("sys/fs/cgroup/app/cgroup.controllers", "cpuset cpu\n");
  ExclusiveCpusets cpusets{kernel()};
  EXPECT_EQ(cpusets.join(kTid, {3}).error, 0);
  const std::string folder = "app/" + own("3") + "/";
  EXPECT_EQ(text(folder + "cgroup.type"), "threaded");
  EXPECT_EQ(text("app/cgroup.subtree_control"), "+cpuset");
  EXPECT_EQ(text(folder + "cpuset.cpus"), "3");
  EXPECT_EQ(text(folder + "cpuset.cpus.partition"), "root");
  EXPECT_EQ(text(folder + "cgroup.threads"), "77");
}

TEST_F(Cpusets, AreRefusedWhereThereAreNone) {
  ExclusiveCpusets cpusets{kernel()};
  EXPECT_EQ(cpusets.join(kTid, {0}).error, ENOENT);
}

}  // namespace
}  // namespace cie::scheduling
