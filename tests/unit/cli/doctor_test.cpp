// `cie doctor` on machines that are folders of files: each finding from what the files say.
#include "doctor.hpp"

#include "support/temporary_directory.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* kClock = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
constexpr const char* kRuntime = "/proc/sys/kernel/sched_rt_runtime_us";

std::string status_of(const std::string& uid, const std::string& capabilities,
                      const std::string& groups) {
  return "Name:\tcie\nUid:\t" + uid + "\t" + uid + "\t" + uid + "\t" + uid + "\nGroups:\t" +
         groups + " \nCapEff:\t" + capabilities + "\n";
}

// A machine on which everything is well; tests change one thing.
class Doctor : public testing::Test {
 protected:
  Doctor() {
    write("/proc/self/status", status_of("0", "000001ffffffffff", "0"));
    write("/proc/self/limits",
          "Limit                     Soft Limit   Hard Limit   Units\n"
          "Max realtime priority     0            0            \n");
    write("/proc/self/cgroup", "0::/\n");
    write("/usr/bin/lttng-sessiond", "");
    write("/proc/net/unix", "Num       RefCount Protocol Flags    Type St Inode Path\n");
    write("/etc/group", "root:x:0:\ntracing:x:107:ann\n");
    write(kRuntime, "-1\n");
    write("/proc/sys/kernel/sched_rt_period_us", "1000000\n");
    write("/sys/kernel/btf/vmlinux", "");
    write("/sys/devices/system/cpu/online", "0-1\n");
    write(kClock, "tsc\n");
    fs::create_directories(root() / "dev/shm");
  }

  fs::path root() const { return directory_.path(); }
  void write(const std::string& path, const std::string& text) const {
    const auto file = root() / fs::path(path).relative_path();
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  void remove(const std::string& path) const {
    fs::remove_all(root() / fs::path(path).relative_path());
  }
  Finding finding(const std::string& id) const {
    for (const auto& finding : examine(Machine(root())))
      if (finding.id == id) return finding;
    throw std::out_of_range(id);
  }
  void expect(const std::string& id, Health health, const std::string& what) const {
    const auto found = finding(id);
    EXPECT_EQ(label(found.health), label(health)) << id << ": " << found.what;
    EXPECT_THAT(found.what, HasSubstr(what));
    EXPECT_EQ(found.advice.empty(), health == Health::ok) << "advice where it is needed";
  }
  void listen_on(const std::string& paths) const {
    std::string text = "Num       RefCount Protocol Flags    Type St Inode Path\n";
    std::istringstream words(paths);
    for (std::string path; words >> path;)
      text += "ffff9d8a: 00000002 00000000 00010000 0001 01 17 " + path + "\n";
    // Connections of others, which listen to nobody.
    text +=
        "ffff9d8b: 00000003 00000000 00000000 0001 03 18 /elsewhere/.lttng/client-lttng-sessiond\n";
    write("/proc/net/unix", text);
  }

  test::TemporaryDirectory directory_;
};

TEST_F(Doctor, FindsNothingWhereAllIsWell) {
  for (const auto& finding : examine(Machine(root()))) {
    if (finding.id == "shared-memory") continue;  // the space is this machine's
    EXPECT_EQ(finding.health, Health::ok) << finding.id << ": " << finding.what;
    EXPECT_EQ(finding.advice, "") << finding.id;
  }
}

TEST_F(Doctor, SurvivesAMachineWithoutAnyFile) {
  const Machine nothing(root() / "no such folder");
  EXPECT_EQ(examine(nothing).size(), examine(Machine(root())).size());
}

TEST_F(Doctor, TellsWhoseSessionDaemonRuns) {
  expect("session-daemon", Health::ok, "none runs");
  listen_on("/run/lttng/client-lttng-sessiond");
  expect("session-daemon", Health::ok, "root's runs");
  listen_on("/home/ann/.lttng/client-lttng-sessiond");
  expect("session-daemon", Health::ok, "in /home/ann");
  listen_on("/run/lttng/client-lttng-sessiond /home/ann/.lttng/client-lttng-sessiond");
  expect("session-daemon", Health::warning, "several run: root's, and in /home/ann");
}

TEST_F(Doctor, LooksForTheSessionDaemonThatARecorderWouldStart) {
  remove("/usr/bin/lttng-sessiond");
  expect("session-daemon", Health::problem, "no lttng-sessiond in PATH");
  listen_on("/run/lttng/client-lttng-sessiond");
  expect("session-daemon", Health::ok, "root's runs");
}

TEST_F(Doctor, RootsDaemonIsForTheTracingGroup) {
  listen_on("/run/lttng/client-lttng-sessiond");
  write("/proc/self/status", status_of("1000", "0000000000000000", "1000"));
  expect("session-daemon", Health::warning, "may not use it");
  write("/proc/self/status", status_of("1000", "0000000000000000", "1000 107"));
  expect("session-daemon", Health::ok, "root's runs");
}

TEST_F(Doctor, RealTimeNeedsACapabilityOrALimit) {
  expect("real-time", Health::ok, "CAP_SYS_NICE");
  write("/proc/self/status", status_of("1000", "0000000000000000", "1000"));
  expect("real-time", Health::problem, "no real-time policy at all");
  write("/proc/self/limits",
        "Max realtime priority     42                   42                   \n");
  expect("real-time", Health::warning, "RLIMIT_RTPRIO 42");
  write("/proc/self/status", status_of("1000", "0000000000800000", "1000"));  // bit 23
  expect("real-time", Health::ok, "CAP_SYS_NICE");
}

TEST_F(Doctor, AnUnlimitedLimitForbidsNoPriority) {
  write("/proc/self/status", status_of("1000", "0000000000000000", "1000"));
  write("/proc/self/limits",
        "Max realtime priority     unlimited            unlimited            \n");
  expect("real-time", Health::warning, "RLIMIT_RTPRIO is unlimited");
  EXPECT_THAT(finding("real-time").what, HasSubstr("every priority, no SCHED_DEADLINE"));
}

TEST_F(Doctor, ThrottlingLeavesAllSomeOrNoTime) {
  expect("throttling", Health::ok, "off");
  write(kRuntime, "950000\n");
  expect("throttling", Health::warning, "950000 us of each 1000000 us");
  write(kRuntime, "1000000\n");
  expect("throttling", Health::ok, "all of the time");
  write(kRuntime, "0\n");
  expect("throttling", Health::problem, "no time at all");
  remove(kRuntime);
  expect("throttling", Health::ok, "none");
}

TEST_F(Doctor, AControlGroupMayForbidRealTime) {
  write("/proc/self/cgroup", "4:cpu,cpuacct:/user.slice\n0::/\n");
  write("/proc/self/mountinfo",
        "30 25 0:26 / /sys/fs/cgroup/cpu,cpuacct rw,relatime - cgroup cgroup rw,cpu,cpuacct\n");
  expect("group-budget", Health::ok, "no cgroup forbids real-time tasks");
  write("/sys/fs/cgroup/cpu,cpuacct/user.slice/cpu.rt_runtime_us", "0\n");
  expect("group-budget", Health::problem, "no real-time budget");
  EXPECT_THAT(finding("group-budget").advice,
              HasSubstr("> /sys/fs/cgroup/cpu,cpuacct/user.slice/cpu.rt_runtime_us"));
  write("/sys/fs/cgroup/cpu,cpuacct/user.slice/cpu.rt_runtime_us", "950000\n");
  expect("group-budget", Health::ok, "no cgroup forbids real-time tasks");
}

TEST_F(Doctor, AContainersControlGroupLiesWhereItIsMounted) {
  write("/proc/self/cgroup", "4:cpu,cpuacct:/docker/3ec7/app\n0::/\n");
  write("/proc/self/mountinfo",
        "30 25 0:26 /docker/3ec7 /cgroups/cpu ro,relatime - cgroup cgroup rw,cpu,cpuacct\n");
  write("/cgroups/cpu/app/cpu.rt_runtime_us", "0\n");
  expect("group-budget", Health::problem, "no real-time budget");
  EXPECT_THAT(finding("group-budget").advice, HasSubstr("> /cgroups/cpu/app/cpu.rt_runtime_us,"));
}

TEST_F(Doctor, TheSchedulerIsRecordedByBpfOrTracefs) {
  expect("kernel-events", Health::ok, "BPF");
  remove("/sys/kernel/btf");
  expect("kernel-events", Health::warning, "neither BTF nor tracefs");
  write("/sys/kernel/tracing/trace", "");
  expect("kernel-events", Health::ok, "tracefs");
  write("/proc/self/status", status_of("1000", "0000000000000000", "1000"));
  expect("kernel-events", Health::warning, "may not record");
  write("/sys/kernel/btf/vmlinux", "");
  write("/proc/self/status", status_of("1000", "000000c000000000", "1000"));  // bits 38 and 39
  expect("kernel-events", Health::ok, "BPF");
}

// What a second of the scheduler's events shows stands in place of what the kernel promises.
const Finding kPromised{.id = "kernel-events", .health = Health::ok, .what = {}, .advice = {}};

std::string trial_of(const std::string& cpus) {
  return R"({"schema": "cie.kernel-trial/1", "route": "bpf", "length_ns": 1040000000, "cpus": [)" +
         cpus + "]}";
}

TEST(KernelTrial, WithoutHolesIsFine) {
  const auto finding =
      examine_kernel_trial(trial_of(R"({"cpu": 0, "switches": 2000, "untold": 0, "lost": 0},
                  {"cpu": 1, "switches": 1500, "untold": 0, "lost": 0})"),
                           kPromised);
  EXPECT_EQ(finding.id, "kernel-events");
  EXPECT_EQ(label(finding.health), "ok");
  EXPECT_EQ(finding.what, "by bpf, tried for 1.0 s: 3500 switches, none is missing");
}

TEST(KernelTrial, SaysWhatShareOfSwitchesIsMissingAndWhere) {
  // 150 of 1850 + 150, all on CPU 1, of 3850 + 150 in all.
  const auto finding =
      examine_kernel_trial(trial_of(R"({"cpu": 0, "switches": 2000, "untold": 0, "lost": 0},
                  {"cpu": 1, "switches": 1850, "untold": 150, "lost": 0})"),
                           kPromised);
  EXPECT_EQ(label(finding.health), "warning");
  EXPECT_EQ(
      finding.what,
      "by bpf, tried for 1.0 s: the kernel did not report 150 of 4000 context switches, 3.8 %: 150 of "
      "2000 on CPU 1");
  EXPECT_THAT(finding.advice, HasSubstr("not measured"));
}

TEST(KernelTrial, SaysThatBuffersWereFull) {
  const auto finding = examine_kernel_trial(
      trial_of(R"({"cpu": 0, "switches": 2000, "untold": 0, "lost": 7})"), kPromised);
  EXPECT_EQ(label(finding.health), "warning");
  EXPECT_THAT(finding.what, HasSubstr("7 events were lost"));
  EXPECT_THAT(finding.advice, HasSubstr("--kernel-buffer"));
}

TEST(KernelTrial, SaysThatBuffersWereFullBeforeWhatSwitchesAreMissing) {
  const auto finding = examine_kernel_trial(
      trial_of(R"({"cpu": 0, "switches": 1850, "untold": 150, "lost": 7})"), kPromised);
  EXPECT_EQ(label(finding.health), "warning");
  EXPECT_EQ(finding.what,
            "by bpf, tried for 1.0 s: 7 events were lost, the buffers were full; besides, the "
            "kernel did not report 150 of 2000 context switches, 7.5 %: 150 of 2000 on CPU 0");
  EXPECT_THAT(finding.advice, testing::StartsWith("cie record --kernel-buffer"));
}

TEST(KernelTrial, OfAKernelThatTellsNothingIsAWarning) {
  const auto finding = examine_kernel_trial(
      trial_of(R"({"cpu": 0, "switches": 0, "untold": 0, "lost": 0})"), kPromised);
  EXPECT_EQ(label(finding.health), "warning");
  EXPECT_THAT(finding.what, HasSubstr("no switch"));
}

TEST(KernelTrial, ThatIsForbiddenSaysWhyAndWhatToDo) {
  const std::string trial =
      R"({"schema": "cie.kernel-trial/1", "reason": "bpf(): Operation not permitted"})";
  auto finding = examine_kernel_trial(trial, kPromised);
  EXPECT_EQ(label(finding.health), "warning");
  EXPECT_EQ(finding.what, "they cannot be recorded: bpf(): Operation not permitted");
  EXPECT_THAT(finding.advice, HasSubstr("CAP_BPF"));
  auto promised = kPromised;
  promised.advice = "build a kernel";
  EXPECT_EQ(examine_kernel_trial(trial, promised).advice, "build a kernel");
}

TEST(KernelTrial, OfAnotherProgramIsAnError) {
  EXPECT_THROW(examine_kernel_trial("cie-record 0.1", kPromised), std::runtime_error);
  EXPECT_THROW(examine_kernel_trial(R"({"schema": "cie.kernel-trial/1"})", kPromised),
               std::runtime_error);
}

TEST_F(Doctor, LttngsModulesAreNotNeeded) {
  expect("lttng-modules", Health::ok, "not loaded");
  fs::create_directories(root() / "sys/module/lttng_tracer");
  expect("lttng-modules", Health::ok, "loaded");
}

TEST_F(Doctor, AGovernorThatSavesPowerCostsTime) {
  expect("governor", Health::ok, "does not change");
  write("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  expect("governor", Health::ok, "performance");
  write("/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n");
  expect("governor", Health::warning, "powersave on CPU 1");
  write("/sys/devices/system/cpu/cpu7/cpufreq/scaling_governor", "ondemand\n");  // offline
  EXPECT_THAT(finding("governor").what, testing::Not(HasSubstr("ondemand")));
}

TEST_F(Doctor, ASlowClockIsAProblem) {
  for (const char* fast : {"tsc", "arch_sys_counter", "kvm-clock"}) {
    write(kClock, std::string(fast) + "\n");
    expect("clock-source", Health::ok, fast);
  }
  for (const char* slow : {"hpet", "acpi_pm", "refined-jiffies"}) {
    write(kClock, std::string(slow) + "\n");
    expect("clock-source", Health::problem, slow);
  }
}

TEST_F(Doctor, BuffersNeedRoomInSharedMemory) {
  remove("/dev/shm");
  expect("shared-memory", Health::problem, "no /dev/shm");
  fs::create_directories(root() / "dev/shm");
  // 10 MiB for each CPU; no machine has the 655 GiB that 65 536 of them take.
  write("/sys/devices/system/cpu/online", "0\n");
  EXPECT_THAT(finding("shared-memory").what, HasSubstr("cie record takes 10 MiB"));
  write("/sys/devices/system/cpu/online", "0-65535\n");
  EXPECT_THAT(finding("shared-memory").what, HasSubstr("cie record takes 655360 MiB"));
}

class Buffers : public Doctor {
 protected:
  // A recording of 10 s with sub-buffers of 1000 bytes.
  void record(std::uint64_t num_subbuf, std::uint64_t discarded, std::size_t bytes,
              std::uint64_t lost_by_kernel = 0) const {
    write("/rec/manifest.json",
          R"({"schema": "cie.recording/1", "begin": {"monotonic_ns": 5000000000},
              "end": {"monotonic_ns": 15000000000},
              "session": {"subbuf_size": 1000, "num_subbuf": )" +
              std::to_string(num_subbuf) + R"(},
              "channels": [{"name": "events", "discarded_events": )" +
              std::to_string(discarded) +
              R"(}], "kernel": {"route": "bpf", "buffer_size": 4194304, "lost_events": )" +
              std::to_string(lost_by_kernel) + "}}");
    write("/rec/ust/uid/0/64-bit/metadata", "");
    write("/rec/ust/uid/0/64-bit/events_0", std::string(bytes / 2, '\0'));
    write("/rec/ust/uid/0/64-bit/events_1", std::string(bytes, '\0'));
    write("/rec/ust/uid/0/64-bit/index/events_1.idx", std::string(9 * bytes, '\0'));
  }
  Finding buffers() const { return examine_buffers(root() / "rec"); }
};

TEST_F(Buffers, AreLargeEnoughForTheBusiestCpu) {
  record(4, 0, 20'000);  // 2 kB/s into 4 kB
  EXPECT_EQ(label(buffers().health), "ok");
  EXPECT_THAT(buffers().what, HasSubstr("2.0 kB/s, for which they last 2.0 s"));
}

TEST_F(Buffers, ThatLastLessThanTwoSecondsAreAWarning) {
  record(4, 0, 40'000);
  EXPECT_EQ(label(buffers().health), "warning");
  EXPECT_THAT(buffers().what, HasSubstr("last 1.0 s"));
  EXPECT_THAT(buffers().advice, HasSubstr("--num-subbuf 8"));
}

TEST_F(Buffers, ThatLostEventsAreAProblem) {
  record(4, 17, 10);
  EXPECT_EQ(label(buffers().health), "problem");
  EXPECT_THAT(buffers().what, HasSubstr("17 events"));
}

TEST_F(Buffers, OfTheKernelThatLostEventsAreAProblem) {
  record(4, 0, 20'000, 23);
  EXPECT_EQ(label(buffers().health), "problem");
  EXPECT_EQ(buffers().what, "too small: the kernel's lost 23 events");
  EXPECT_EQ(buffers().advice,
            "cie record --kernel-buffer 8m");  // twice the 4 MiB that were too few
}

TEST_F(Buffers, ThatBothLostEventsAreBothToBeLarger) {
  record(4, 17, 20'000, 23);
  EXPECT_EQ(buffers().what, "too small: 17 events were discarded, the kernel's lost 23 events");
  EXPECT_EQ(buffers().advice, "cie record --num-subbuf 8 --kernel-buffer 8m");
}

TEST_F(Buffers, OfAnEmptyRecordingAreFine) {
  record(4, 0, 0);
  EXPECT_EQ(label(buffers().health), "ok");
}

TEST_F(Buffers, OfSomethingElseAreAnError) {
  EXPECT_THROW(examine_buffers(root() / "nothing"), std::runtime_error);
  write("/rec/manifest.json", R"({"schema": "cie.recording/1", "channels": 3})");
  EXPECT_THROW(buffers(), std::runtime_error);
  write("/rec/manifest.json", R"({"schema": "other"})");
  EXPECT_THROW(buffers(), std::runtime_error);
}

}  // namespace
}  // namespace cie::cli
