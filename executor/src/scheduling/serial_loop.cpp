#include <cie/scheduling/serial_loop.hpp>

#include <algorithm>

namespace cie::scheduling {

void SerialLoop::on_ready(Callback& callback) noexcept {
  callback.mark_ready();
  wake();
}

// Runs everything that is ready now, in order, one instance of each at a time.
bool SerialLoop::pass() {
  bool has_run = false;
  for (const auto& callback : served()) {
    if (is_interrupted()) return true;
    // A timer needs no mark: execute_one() looks at the clock itself.
    if (!callback->take_ready_mark() && callback->next_due() == kNever) continue;
    if (!run_instance(*callback)) continue;
    has_run = true;
    if (callback->has_queue()) callback->mark_ready();  // there may be more in it
  }
  return has_run;
}

std::int64_t SerialLoop::next_due() const noexcept {
  std::int64_t next = kNever;
  for (const auto& callback : served())
    next = std::min(next, callback->next_due());
  return next;
}

}  // namespace cie::scheduling
