// Memory that is there before it is needed.
#include "support.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace cie::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::size_t kDepth = 256UL * 1024;  // bytes of stack that the callback uses

[[gnu::noinline]] int use_stack() {
  volatile char stack[kDepth];
  int sum = 0;
  for (std::size_t i = 0; i < kDepth; i += 1024) {
    stack[i] = 1;
    sum += stack[i];
  }
  return sum;
}

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

// Of a callback that uses much stack in its first instance.
long faults_with(const ExecutorOptions& options) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor{options};
  Node node{context, "node"};
  long faults = -1;
  const auto timer = node.create_wall_timer(1ms, [&] {
    const long before = page_faults();
    EXPECT_EQ(use_stack(), static_cast<int>(kDepth / 1024));
    if (faults < 0) faults = page_faults() - before;
    executor.cancel();
  });
  executor.add_node(node);
  executor.spin_for(20s);
  return faults;
}

TEST(Stack, ThatWasTouchedFaultsNoMore) {
  ExecutorOptions options;
  options.prefault_stack = 2 * kDepth;
  EXPECT_LE(faults_with(options), 2);  // the code itself may have been a page not used yet
  std::ifstream file{"/sys/kernel/mm/transparent_hugepage/enabled"};
  std::string huge;
  std::getline(file, huge);
  if (huge.find("[always]") == std::string::npos) {
    EXPECT_GT(faults_with({}), 32);
  }
}

TEST(Stack, ThatIsTooSmallIsAProblem) {
  ExecutorOptions options;
  options.prefault_stack = std::size_t{1} << 40U;
  try {
    faults_with(options);
    FAIL() << "nothing was refused";
  } catch (const SchedulingRefused& refused) {
    EXPECT_EQ(refused.problems().front().error, ENOMEM);
    EXPECT_THAT(refused.what(), HasSubstr("prefault_stack"));
  }
}

// kB, of a line of /proc/self/status.
long status(const std::string& name) {
  std::ifstream file{"/proc/self/status"};
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(name + ":")) return std::stol(line.substr(name.size() + 1));
  }
  return -1;
}

ExecutorOptions locking(LockMemory wish) {
  ExecutorOptions options;
  options.lock_memory = wish;
  return options;
}

TEST(Memory, IsLockedAsItIsUsed) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor{locking(LockMemory::on_fault)};
  Node node{context, "node"};
  std::vector<std::shared_ptr<Timer>> timers;
  for (int i = 1; i <= 24; ++i)
    timers.push_back(node.create_wall_timer(std::chrono::milliseconds{i}, [] {}));
  executor.add_node(node);
  const long before = status("VmRSS");
  try {
    executor.spin_for(100ms);
  } catch (const SchedulingRefused& refused) {
    GTEST_SKIP() << "not possible here: " << refused.what();
  }
  EXPECT_GT(status("VmLck"), 24 * 1024L) << "the stacks of 24 threads are covered";
  EXPECT_LT(status("VmRSS") - before, 24 * 1024L) << "and cost no memory before they are used";
  munlockall();
}

// Of a callback that has one message larger than any that glibc keeps in the heap of itself (32 MB),
// and as many others at once as make it give the end of the heap back.
long faults_of_messages() {
  const long before = page_faults();
  std::vector<std::unique_ptr<char[]>> messages;
  for (int i = 0; i < 9; ++i) {
    const std::size_t size = (i == 0 ? 33UL : 1UL) << 20;
    messages.push_back(std::make_unique<char[]>(size));
    std::memset(messages.back().get(), 1, size);
  }
  return page_faults() - before;
}

TEST(Memory, OfLargeMessagesIsKept) {
  Context context{private_options()};
  CallbackIsolatedExecutor executor{locking(LockMemory::on_fault)};
  Node node{context, "node"};
  std::vector<long> faults;
  const auto timer = node.create_wall_timer(1ms, [&] {
    faults.push_back(faults_of_messages());
    if (faults.size() == 5) executor.cancel();
  });
  executor.add_node(node);
  try {
    executor.spin_for(20s);
  } catch (const SchedulingRefused& refused) {
    GTEST_SKIP() << "not possible here: " << refused.what();
  }
  munlockall();
  ASSERT_GE(faults.size(), 5U);
  EXPECT_GT(faults.front(), 256);
  EXPECT_LE(faults.back(), 2);  // the code itself may have been a page not used yet
}

TEST(Memory, BeyondTheLimitIsRefusedByName) {
  constexpr rlim_t kLittle = 64UL * 1024;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const rlimit little{.rlim_cur = std::min(kLittle, limit.rlim_max), .rlim_max = limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_MEMLOCK, &little), 0);
  std::thread{[] {
    // Root has the capability; this thread of it gives it up.
    __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
    __user_cap_data_struct data[2]{};
    syscall(SYS_capget, &header, data);
    data[0].effective &= ~(1U << CAP_IPC_LOCK);
    ASSERT_EQ(syscall(SYS_capset, &header, data), 0);
    try {
      faults_with(locking(LockMemory::all));
      ADD_FAILURE() << "nothing was refused";
    } catch (const SchedulingRefused& refused) {
      EXPECT_THAT(refused.what(), AllOf(HasSubstr("cannot lock memory"),
                                        HasSubstr("RLIMIT_MEMLOCK"), HasSubstr("64 kB")));
    }
  }}.join();
  setrlimit(RLIMIT_MEMLOCK, &limit);
}

}  // namespace
}  // namespace cie::test
