// How several threads sleep until somebody says that something has happened.
#pragma once

#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/wakeup.hpp>

#include <atomic>
#include <cstdint>

namespace cie::scheduling {

// What has happened is the users' to know: a thread asks for a ticket, looks, and if there is nothing
// for it sleeps on that ticket; a notification after the ticket ends the sleep, so none is lost between
// the look and the sleep. Notifying takes no lock, of whichever kind: a condition variable of glibc has
// one within that knows no priorities. Any number of threads on both sides; a system call only if
// somebody sleeps.
class EventCount {
 public:
  enum class Ticket : std::uint32_t {};

  Ticket ticket() const noexcept { return Ticket{count_.load()}; }
  // Any thread, and a signal handler. Of those that sleep, the most urgent wakes up, or all.
  void notify_one() noexcept { notify(1); }
  void notify_all() noexcept { notify(kAll); }
  // As a condition variable's: `is_there` is asked with the lock held.
  template <typename Lock, typename Predicate>
  void wait(Lock& lock, Predicate is_there) {
    for (;;) {
      const Ticket before = ticket();
      if (is_there()) return;
      lock.unlock();
      wait_until(before, kNever);
      lock.lock();
    }
  }
  // Sleeps until a notification after the ticket, or until `deadline_ns` of CLOCK_MONOTONIC (kNever:
  // without end).
  WaitResult wait_until(Ticket ticket, std::int64_t deadline_ns) noexcept;

 private:
  static constexpr int kAll = INT32_MAX;

  void notify(int threads) noexcept {
    count_.fetch_add(1);
    if (sleepers_.load() > 0) wake(threads);
  }
  void wake(int threads) noexcept;

  std::atomic<std::uint32_t> count_{0};
  std::atomic<int> sleepers_{0};
};

}  // namespace cie::scheduling
