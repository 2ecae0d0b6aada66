// The wish that spinning ends.
#pragma once

#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/wakeup.hpp>

#include <atomic>
#include <cstdint>

namespace cie::scheduling {

// One thread waits for it, any number look. A cancel() that came before ends the next wait at once.
class Cancellation {
 public:
  // An atomic and a futex: also in a signal handler. Whoever looks after it has returned, sees it.
  void cancel() noexcept {
    is_cancelled_.store(true);
    wakeup_.notify();
  }
  bool is_cancelled() const noexcept { return is_cancelled_.load(); }
  void reset() noexcept { is_cancelled_.store(false); }
  // Until cancel(), or until `deadline_ns` of CLOCK_MONOTONIC.
  void wait_until(std::int64_t deadline_ns) noexcept {
    while (!is_cancelled()) {
      if (wakeup_.wait_until(deadline_ns) == WaitResult::timeout) return;
    }
  }

 private:
  std::atomic<bool> is_cancelled_{false};
  Wakeup wakeup_;
};

}  // namespace cie::scheduling
