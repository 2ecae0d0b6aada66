// A mutex for threads of different priorities.
#pragma once

#include <chrono>
#include <mutex>
#include <type_traits>

namespace cie {

// Its holder runs with the priority of the most urgent thread that waits for it, so that a thread
// of middle priority cannot hold up both (POSIX: PTHREAD_PRIO_INHERIT). Use it for what callbacks
// of different priorities share; std::mutex has no such protection. Lockable, for std::lock_guard
// and std::unique_lock; not recursive. Locking a free one costs no system call. Where the kernel
// knows no such mutexes, it is an ordinary one.
class PriorityMutex {
 public:
  PriorityMutex() noexcept;
  ~PriorityMutex();
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  void lock() noexcept;
  bool try_lock() noexcept;
  // Gives up after `duration`; true if the lock is held.
  bool try_lock_for(std::chrono::nanoseconds duration) noexcept;
  void unlock() noexcept;

 private:
  std::remove_pointer_t<std::mutex::native_handle_type> mutex_;
};

}  // namespace cie
