#include <cie/tracepoints/priority_mutex.hpp>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <fstream>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<std::int64_t> clock_is_ahead_by_s{0};

}  // namespace

// In place of libc's: a settable clock that is set back while somebody waits.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto status = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (clock == CLOCK_REALTIME) time->tv_sec += clock_is_ahead_by_s;
  return status;
}

namespace cie {
namespace {

using namespace std::chrono_literals;

TEST(PriorityMutex, WaitsByTheClockThatNobodySets) {
  PriorityMutex mutex;
  const std::lock_guard lock{mutex};
  clock_is_ahead_by_s = 60;
  const auto begin = std::chrono::steady_clock::now();
  std::thread{[&] { EXPECT_FALSE(mutex.try_lock_for(1ms)); }}.join();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s) << "it waited until the time had come";
  clock_is_ahead_by_s = 0;
}

TEST(PriorityMutex, IsHeldByOne) {
  PriorityMutex mutex;
  {
    const std::lock_guard lock{mutex};
    std::thread{[&] {
      EXPECT_FALSE(mutex.try_lock());
      EXPECT_FALSE(mutex.try_lock_for(1ms));
    }}.join();
  }
  std::thread{[&] {
    ASSERT_TRUE(mutex.try_lock_for(1s));
    mutex.unlock();
    ASSERT_TRUE(mutex.try_lock());
    mutex.unlock();
  }}.join();
}

// Field 18 of stat: 20 + nice, or -1 - priority of a real-time thread, what it inherited included.
int running_priority(pid_t tid) {
  std::ifstream file{"/proc/self/task/" + std::to_string(tid) + "/stat"};
  std::string text;
  std::getline(file, text);
  std::istringstream fields{text.substr(text.rfind(')') + 2)};
  for (int field = 3; field < 18; ++field)
    fields >> text;
  int priority = 0;
  fields >> priority;
  return priority;
}

TEST(PriorityMutex, LendsThePriorityOfWhoWaits) {
  PriorityMutex mutex;
  mutex.lock();
  const pid_t holder = gettid();
  const int before = running_priority(holder);
  std::atomic<bool> is_real_time{false};
  std::atomic<bool> is_tried{false};
  std::thread waiter{[&] {
    const sched_param parameter{.sched_priority = 17};
    is_real_time = sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
    is_tried = true;
    const std::lock_guard lock{mutex};
  }};
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (!is_tried)
    std::this_thread::sleep_for(1ms);
  while (is_real_time && running_priority(holder) == before &&
         std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(1ms);
  }
  const int lent = running_priority(holder);
  mutex.unlock();
  waiter.join();
  if (!is_real_time) GTEST_SKIP() << "not possible here: needs CAP_SYS_NICE";
  EXPECT_EQ(lent, -1 - 17);
  EXPECT_EQ(running_priority(holder), before);
}

}  // namespace
}  // namespace cie
