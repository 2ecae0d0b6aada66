// A mutex whose holder inherits the priority of who waits for it: the announcing thread runs at low
// priority and must not delay a real-time thread that registers itself. BasicLockable.
#pragma once

#include <cstdint>
#include <ctime>

#include <pthread.h>

namespace cie::trace {

class PriorityMutex {
 public:
  PriorityMutex() noexcept {
    pthread_mutexattr_t attributes{};
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    if (pthread_mutex_init(&mutex_, &attributes) != 0) {  // kernel without PI futexes
      pthread_mutex_init(&mutex_, nullptr);
    }
    pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityMutex() { pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  void lock() noexcept { pthread_mutex_lock(&mutex_); }
  void unlock() noexcept { pthread_mutex_unlock(&mutex_); }
  // Gives up after `seconds`; true if the lock is held.
  bool try_lock_for(std::time_t seconds) noexcept {
    timespec deadline{};
    clock_gettime(CLOCK_REALTIME, &deadline);
    deadline.tv_sec += seconds;
    return pthread_mutex_timedlock(&mutex_, &deadline) == 0;
  }

 private:
  pthread_mutex_t mutex_{};
};

}  // namespace cie::trace
