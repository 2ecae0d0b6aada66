// How one thread sleeps and others wake it: one futex word, with an absolute timeout.
#pragma once

#include "clock.hpp"

#include <atomic>
#include <cerrno>
#include <cstdint>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

namespace cie::executor {

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
      syscall(SYS_futex, address(), FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
    }
  }

  // Sleeps until notified or until `deadline_ns` of CLOCK_MONOTONIC (kNever: without end). One
  // thread at a time. A deadline that has passed returns `timeout` unless a signal is pending.
  WaitResult wait_until(std::int64_t deadline_ns) noexcept {
    std::uint32_t expected = kIdle;
    if (!word_.compare_exchange_strong(expected, kWaiting, std::memory_order_acq_rel)) {
      word_.exchange(kIdle, std::memory_order_acq_rel);  // reads what the latest notifier wrote
      return WaitResult::not_waited;
    }
    timespec timeout{};
    if (deadline_ns != kNever) {
      timeout.tv_sec = deadline_ns / 1'000'000'000;
      timeout.tv_nsec = deadline_ns % 1'000'000'000;
    }
    const auto status =
        syscall(SYS_futex, address(), FUTEX_WAIT_BITSET_PRIVATE, kWaiting,
                deadline_ns == kNever ? nullptr : &timeout, nullptr, FUTEX_BITSET_MATCH_ANY);
    const bool is_timeout = status == -1 && errno == ETIMEDOUT;
    if (word_.exchange(kIdle, std::memory_order_acq_rel) == kSignalled) {
      return WaitResult::signalled;
    }
    return is_timeout ? WaitResult::timeout : WaitResult::spurious;
  }

 private:
  static constexpr std::uint32_t kIdle = 0;
  static constexpr std::uint32_t kSignalled = 1;
  static constexpr std::uint32_t kWaiting = 2;

  std::uint32_t* address() noexcept { return reinterpret_cast<std::uint32_t*>(&word_); }

  std::atomic<std::uint32_t> word_{kIdle};
  static_assert(sizeof(word_) == sizeof(std::uint32_t) &&
                std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace cie::executor
