#include <cie/scheduling/wakeup.hpp>

#include <cerrno>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

namespace cie::scheduling {

void Wakeup::wake() noexcept {
  syscall(SYS_futex, address(), FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
}

WaitResult Wakeup::wait_until(std::int64_t deadline_ns) noexcept {
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

}  // namespace cie::scheduling
