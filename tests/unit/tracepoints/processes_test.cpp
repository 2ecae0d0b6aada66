// What /proc tells of other processes.
#include "system/processes.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::record {
namespace {

// A process that does as it is told until it is killed.
class Child {
 public:
  explicit Child(void (*act)()) : pid_(fork()) {
    if (pid_ != 0) return;
    for (;;)
      act();
  }
  ~Child() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_;
};

bool falls_asleep(pid_t pid) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!is_asleep(pid)) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

TEST(Processes, OneThatWaitsIsAsleep) {
  const Child child([] { pause(); });
  EXPECT_TRUE(falls_asleep(child.pid()));
}

TEST(Processes, OneThatWorksIsNot) {
  const Child child([] {});
  for (int look = 0; look < 100; ++look)
    EXPECT_FALSE(is_asleep(child.pid()));
}

TEST(Processes, OneOfWhoseThreadsOneWorksIsNot) {
  // This one asks, so it runs.
  std::jthread waits([](const std::stop_token& stop) {
    while (!stop.stop_requested())
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  });
  EXPECT_FALSE(is_asleep(getpid()));
}

TEST(Processes, OneThatIsGoneHasNothingToDo) {
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  waitpid(gone, nullptr, 0);
  EXPECT_TRUE(is_asleep(gone));
}

TEST(Processes, AChildRunsUntilItEndsThoughNobodyWaitedForIt) {
  const Child child([] { pause(); });
  const auto children = children_of(getpid());
  EXPECT_NE(std::ranges::find(children, child.pid()), children.end());
  const auto identity = identity_of(child.pid());
  EXPECT_TRUE(is_running(identity));
  kill(child.pid(), SIGKILL);
  siginfo_t ended{};
  waitid(P_PID, static_cast<id_t>(child.pid()), &ended, WEXITED | WNOWAIT);
  EXPECT_FALSE(is_running(identity));
  auto former = identity_of(getpid());
  ++former.start_ticks;
  EXPECT_FALSE(is_running(former)) << "another one has its pid";
}

TEST(Processes, HaveTheArgumentsThatTheyWereStartedWith) {
  std::ifstream file("/proc/self/cmdline");
  std::string program;
  std::getline(file, program, '\0');
  EXPECT_TRUE(has_argument(getpid(), program));
  EXPECT_FALSE(has_argument(getpid(), program.substr(1)));
}

}  // namespace
}  // namespace cie::record
