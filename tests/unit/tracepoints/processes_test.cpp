// What /proc tells of other processes.
#include "system/processes.hpp"

#include <chrono>
#include <csignal>
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

}  // namespace
}  // namespace cie::record
