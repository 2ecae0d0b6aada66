#include <cie/scheduling/wakeup.hpp>

#include "futex.hpp"

namespace cie::scheduling {

void Wakeup::wake() noexcept { futex_wake(word_, 1); }

WaitResult Wakeup::wait_until(std::int64_t deadline_ns) noexcept {
  std::uint32_t expected = kIdle;
  if (!word_.compare_exchange_strong(expected, kWaiting, std::memory_order_acq_rel)) {
    word_.exchange(kIdle, std::memory_order_acq_rel);  // reads what the latest notifier wrote
    return WaitResult::not_waited;
  }
  const bool is_timeout = futex_wait(word_, kWaiting, deadline_ns) == ETIMEDOUT;
  if (word_.exchange(kIdle, std::memory_order_acq_rel) == kSignalled) {
    return WaitResult::signalled;
  }
  return is_timeout ? WaitResult::timeout : WaitResult::spurious;
}

}  // namespace cie::scheduling
