#include <cie/scheduling/event_count.hpp>

#include "futex.hpp"

namespace cie::scheduling {

void EventCount::wake(int threads) noexcept { futex_wake(count_, threads); }

WaitResult EventCount::wait_until(Ticket ticket, std::int64_t deadline_ns) noexcept {
  const auto value = static_cast<std::uint32_t>(ticket);
  sleepers_.fetch_add(1);
  const int error = futex_wait(count_, value, deadline_ns);
  sleepers_.fetch_sub(1);
  if (error == EAGAIN) return WaitResult::not_waited;
  if (count_.load() != value) return WaitResult::signalled;
  return error == ETIMEDOUT ? WaitResult::timeout : WaitResult::spurious;
}

}  // namespace cie::scheduling
