#include "announcer.hpp"

#include <cie/tracepoints/schema.hpp>

#include "base/clock.hpp"
#include "provider.h"

#include <ctime>
#include <new>
#include <utility>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace cie::trace {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kPollWhileUntraced = 600'000'000;
constexpr std::int64_t kSettle = 150'000'000;

// Bumped whenever the announcer has something to look at; its futex.
std::atomic<std::uint32_t> wakeups{0};
// How many session starts LTTng told of.
std::atomic<std::uint32_t> session_starts{0};

void wake() noexcept {
  wakeups.fetch_add(1, std::memory_order_release);
  syscall(SYS_futex, &wakeups, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
}

void count_session_start() noexcept {
  session_starts.fetch_add(1, std::memory_order_release);
  wake();
}

void wait(std::uint32_t seen_wakeups, std::int64_t nanoseconds) noexcept {
  const timespec timeout{.tv_sec = nanoseconds / kSecond, .tv_nsec = nanoseconds % kSecond};
  syscall(SYS_futex, &wakeups, FUTEX_WAIT_PRIVATE, seen_wakeups, &timeout, nullptr, 0);
}

}  // namespace

Announcer::Announcer(Actions actions)
    : actions_(std::move(actions)), seen_(session_starts.load(std::memory_order_acquire)) {
  watch_session_starts(&count_session_start);
  thread_.emplace("cie-announce", [this] { run(); });
}

Announcer::~Announcer() {
  is_stopping_.store(true, std::memory_order_release);
  wake();
}

// Without memory for the read-backs the announcement is tried again at the next wake-up.
bool Announcer::try_announce() noexcept {
  try {
    actions_.announce();
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

void Announcer::run() noexcept {
  std::uint32_t announced_events = enabled_events();  // to those a session had at run_begin
  std::int64_t next_sync = now_ns(CLOCK_MONOTONIC);
  while (true) {
    const std::uint32_t seen_wakeups = wakeups.load(std::memory_order_acquire);
    if (is_stopping_.load(std::memory_order_acquire)) {
      return;
    }
    const std::uint32_t starts = session_starts.load(std::memory_order_acquire);
    const std::uint32_t events = enabled_events();
    if ((events & kRos2Events) == 0 && (announced_events & kRos2Events) != 0) {
      actions_.forget_ros2_readers();
    }
    if (starts != seen_) {
      if (try_announce()) {
        seen_ = starts;
        announced_events = events;
      }
    } else if ((events & ~announced_events) != 0) {
      wait(seen_wakeups, kSettle);  // events are enabled one by one: let the others follow
      const bool is_settled =
          enabled_events() == events && session_starts.load(std::memory_order_acquire) == starts;
      if (!is_settled || !try_announce()) {
        continue;
      }
      announced_events = events;
    } else {
      announced_events = events;  // what is disabled meanwhile counts as new when it comes back
    }
    std::int64_t pause = kPollWhileUntraced;
    if (events != 0) {
      const std::int64_t now = now_ns(CLOCK_MONOTONIC);
      if (now >= next_sync) {
        actions_.sync_clocks();
        next_sync = now + kClockSyncPeriod.count();
      }
      pause = next_sync - now;
    }
    wait(seen_wakeups, pause);
  }
}

}  // namespace cie::trace
