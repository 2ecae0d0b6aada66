// Waiting for calls that threads and signal handlers make without a lock.
#pragma once

#include <atomic>
#include <ctime>

namespace cie::executor {

// Counts the calls that may still use something. Whoever takes that away from new calls waits here
// for the others. Any thread; entering and leaving are async-signal-safe.
class CallsInProgress {
 public:
  void enter() noexcept { count_.fetch_add(1); }
  void leave() noexcept { count_.fetch_sub(1); }

  // Sleeps in between: the call may be one that this very thread preempted. A signal ends a sleep
  // early, and none is completed: to the remaining time Linux adds the timer's slack, so with
  // std::this_thread::sleep_for() this would never end while signals come faster than that.
  void wait_for_none() const noexcept {
    constexpr timespec kPause{0, 50'000};
    while (count_.load() != 0)
      nanosleep(&kPause, nullptr);
  }

 private:
  std::atomic<int> count_{0};
  static_assert(std::atomic<int>::is_always_lock_free);
};

}  // namespace cie::executor
