#include "cpu_usage.hpp"

#include "support/temporary_directory.hpp"

#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>

namespace cie::live {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::steady_clock;

// A /proc with one thread in it.
class CpuUsageTest : public testing::Test {
 protected:
  CpuUsageTest() {
    const auto root = directory_.path();
    fs::create_directories(root / "sys/kernel/random");
    std::ofstream(root / "sys/kernel/random/boot_id") << "boot\n";
    fs::create_directories(root / "self/ns");
    std::ofstream(root / "self/ns/pid") << "";
    struct stat status {};
    EXPECT_EQ(stat((root / "self/ns/pid").c_str(), &status), 0);
    fs::create_directories(root / "7/task/8");
    analysis::ProcessReport process;
    process.host = "h";
    process.pid = 7;
    process.boot_id = "boot";
    process.pid_ns = status.st_ino;
    report_.processes.push_back(process);
    thread_.tid = 8;
  }
  void uses(std::int64_t ns) {
    std::ofstream(directory_.path() / "7/task/8/schedstat") << ns << " 1 2\n";
  }
  std::optional<double> ask(CpuUsage& usage, seconds at) {
    usage.begin(report_, steady_clock::time_point(at));
    const auto result = usage.of(thread_);
    usage.end();
    return result;
  }
  test::TemporaryDirectory directory_;
  analysis::Report report_;
  analysis::ThreadReport thread_;
};

TEST_F(CpuUsageTest, IsThePartOfTheTimeBetweenTwoRounds) {
  CpuUsage usage(directory_.path().string());
  uses(1'000'000'000);
  EXPECT_FALSE(ask(usage, seconds(10)));  // nothing to compare with yet
  uses(1'500'000'000);
  const auto percent = ask(usage, seconds(12));
  ASSERT_TRUE(percent);
  EXPECT_DOUBLE_EQ(*percent, 25.0);
}

TEST_F(CpuUsageTest, OfAnotherMachineIsWhatItsKernelTold) {
  report_.processes.front().boot_id = "another";
  CpuUsage usage(directory_.path().string());
  uses(1);
  thread_.busy_ns = 0;
  EXPECT_FALSE(ask(usage, seconds(1)));
  thread_.busy_ns = 500'000'000;
  const auto percent = ask(usage, seconds(2));
  ASSERT_TRUE(percent);
  EXPECT_DOUBLE_EQ(*percent, 50.0);
  thread_.busy_ns.reset();
  EXPECT_FALSE(ask(usage, seconds(3)));
  EXPECT_FALSE(usage.is_gone(thread_)) << "nobody here can know";
  EXPECT_FALSE(usage.is_gone(thread_.process));
}

TEST_F(CpuUsageTest, AThreadThatEndedIsGone) {
  CpuUsage usage(directory_.path().string());
  usage.begin(report_, {});
  EXPECT_FALSE(usage.is_gone(thread_));
  EXPECT_FALSE(usage.is_gone(thread_.process));
  fs::remove_all(directory_.path() / "7");
  EXPECT_TRUE(usage.is_gone(thread_));
  EXPECT_TRUE(usage.is_gone(thread_.process)) << "though it did not tell";
}

}  // namespace
}  // namespace cie::live
