// How one thread sleeps and others wake it: one futex word, with an absolute timeout.
#pragma once

#include <cie/scheduling/clock.hpp>

#include <atomic>
#include <cstdint>

namespace cie::scheduling {

// Why wait_until() returned. `not_waited` means that the signal was there already: no system call
// was made and the thread never slept.
enum class WaitResult : std::uint8_t { not_waited, signalled, timeout, spurious };

// One waiting thread, any number of notifying ones. A notify() before the wait is kept; several are
// one. The word goes idle -> waiting -> signalled -> idle, and notify() makes a system call only if
// somebody waits: wait, wake-up and timer in one, at the price of one system call on each side.
class Wakeup {
 public:
  // Any thread, and a signal handler.
  void notify() noexcept {
    if (word_.exchange(kSignalled, std::memory_order_acq_rel) == kWaiting) {
      wake();
    }
  }

  // Sleeps until notified or until `deadline_ns` of CLOCK_MONOTONIC (kNever: without end). One
  // thread at a time. A deadline that has passed returns `timeout` unless a signal is pending.
  WaitResult wait_until(std::int64_t deadline_ns) noexcept;

 private:
  static constexpr std::uint32_t kIdle = 0;
  static constexpr std::uint32_t kSignalled = 1;
  static constexpr std::uint32_t kWaiting = 2;

  void wake() noexcept;

  std::atomic<std::uint32_t> word_{kIdle};
};

}  // namespace cie::scheduling
