// What a machine's files say, of machines that are written down here.
#include <cie/tracepoints/machine_files.hpp>

#include "support/temporary_directory.hpp"

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie {
namespace {

class MachineFilesOf : public testing::Test {
 protected:
  void write(const std::string& file, const std::string& text) const {
    create_directories(machine.path(file).parent_path());
    std::ofstream(machine.path(file)) << text;
  }

 private:
  test::TemporaryDirectory directory_;

 protected:
  MachineFiles machine{directory_.path()};
};

TEST_F(MachineFilesOf, NoMachineTellNothing) {
  EXPECT_FALSE(machine.has("/proc"));
  EXPECT_EQ(machine.text("/proc/self/status"), std::nullopt);
  EXPECT_EQ(machine.number("/proc/sys/kernel/sched_rt_runtime_us"), std::nullopt);
  EXPECT_EQ(machine.status("CapEff"), std::nullopt);
  EXPECT_EQ(machine.has_capability(23), std::nullopt) << "neither yes nor no";
  EXPECT_EQ(machine.limit("Max realtime priority"), std::nullopt);
  EXPECT_FALSE(machine.control_group("cpu"));
  EXPECT_EQ(machine.online_cpus(), std::vector<std::uint32_t>{0});
}

TEST_F(MachineFilesOf, ATextLackItsLastLineEnd) {
  write("/a", "performance\n");
  write("/b", "one\ntwo\n");
  write("/c", "");
  EXPECT_TRUE(machine.has("/a"));
  EXPECT_EQ(machine.text("/a"), "performance");
  EXPECT_EQ(machine.text("/b"), "one\ntwo");
  EXPECT_EQ(machine.text("/c"), "");
}

TEST_F(MachineFilesOf, ANumberHoldNothingElse) {
  write("/a", "-1\n");
  write("/b", "max\n");
  write("/c", "1 2\n");
  EXPECT_EQ(machine.number("/a"), -1);
  EXPECT_EQ(machine.number("/b"), std::nullopt);
  EXPECT_EQ(machine.number("/c"), std::nullopt);
}

TEST_F(MachineFilesOf, AProcessAndItsThreadsMayDiffer) {
  write("/proc/self/status", "CapEffective:\t1\nCapEff:\t0000000000800000\nGroups:\t\n");
  write("/proc/thread-self/status", "CapEff:\t0000000000000000\n");
  EXPECT_EQ(machine.status("CapEff"), "0000000000800000");
  EXPECT_EQ(machine.status("Groups"), "") << "in none";
  EXPECT_EQ(machine.has_capability(23), true);
  EXPECT_EQ(machine.has_capability(22), false);
  EXPECT_EQ(machine.has_capability(23, "thread-self"), false);
}

TEST_F(MachineFilesOf, LimitsAreTheSoftOnes) {
  write("/proc/self/limits",
        "Limit                     Soft Limit           Hard Limit           Units     \n"
        "Max processes             15639                unlimited            processes \n"
        "Max realtime priority     unlimited            unlimited            \n");
  EXPECT_EQ(machine.limit("Max processes"), 15639U);
  EXPECT_EQ(machine.limit("Max realtime priority"), kUnlimited);
  EXPECT_EQ(machine.limit("Max"), std::nullopt);
  EXPECT_EQ(machine.limit("Max nice priority"), std::nullopt);
}

TEST_F(MachineFilesOf, AControllerHaveItsGroupWhereItIsMounted) {
  write("/proc/self/cgroup", "4:cpu,cpuacct:/docker/3ec7/app\n0::/robot\n");
  write("/proc/self/mountinfo",
        "29 25 0:25 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n"
        "30 25 0:26 /docker/3ec7 /sys/fs/cgroup/cpu,cpuacct ro - cgroup cgroup rw,cpu,cpuacct\n");
  write("/sys/fs/cgroup/unified/robot/cgroup.controllers", "cpuset pids\n");
  const auto cpu = machine.control_group("cpu");
  ASSERT_TRUE(cpu);
  EXPECT_EQ(cpu->mount, "/sys/fs/cgroup/cpu,cpuacct");
  EXPECT_EQ(cpu->folder, "/sys/fs/cgroup/cpu,cpuacct/app");
  EXPECT_FALSE(cpu->is_unified);
  const auto pids = machine.control_group("pids");
  ASSERT_TRUE(pids);
  EXPECT_EQ(pids->folder, "/sys/fs/cgroup/unified/robot");
  EXPECT_TRUE(pids->is_unified);
  EXPECT_FALSE(machine.control_group("memory"));
  EXPECT_FALSE(machine.control_group("pids", "self/task/7")) << "no such thread";
}

TEST_F(MachineFilesOf, OnlineCpusAreRangesOfNumbers) {
  write("/sys/devices/system/cpu/online", "0-2,5,x,7-y\n");
  EXPECT_EQ(machine.online_cpus(), (std::vector<std::uint32_t>{0, 1, 2, 5}));
}

}  // namespace
}  // namespace cie
