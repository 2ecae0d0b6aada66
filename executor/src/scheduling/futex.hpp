// The kernel's queues of threads that sleep on a word.
#pragma once

#include <cie/scheduling/clock.hpp>

#include <atomic>
#include <cerrno>
#include <cstdint>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

namespace cie::scheduling {

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t) &&
              std::atomic<std::uint32_t>::is_always_lock_free);

inline void futex_wake(const std::atomic<std::uint32_t>& word, int threads) noexcept {
  syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, threads, nullptr, nullptr, 0);
}

// Sleeps if the word has this value, until somebody wakes it or `deadline_ns` of CLOCK_MONOTONIC
// (kNever: without end). 0, or why it did not wait so long: EAGAIN, EINTR, ETIMEDOUT.
inline int futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                      std::int64_t deadline_ns) noexcept {
  timespec timeout{};
  if (deadline_ns != kNever) {
    timeout.tv_sec = deadline_ns / 1'000'000'000;
    timeout.tv_nsec = deadline_ns % 1'000'000'000;
  }
  const auto status =
      syscall(SYS_futex, &word, FUTEX_WAIT_BITSET_PRIVATE, value,
              deadline_ns == kNever ? nullptr : &timeout, nullptr, FUTEX_BITSET_MATCH_ANY);
  return status == -1 ? errno : 0;
}

}  // namespace cie::scheduling
