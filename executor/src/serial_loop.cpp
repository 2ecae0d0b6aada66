#include "serial_loop.hpp"

#include <cie/tracepoints/trace.hpp>

#include <algorithm>

namespace cie::executor {
namespace {

WakeupReason reason_of(WaitResult result, bool is_guard) noexcept {
  switch (result) {
    case WaitResult::timeout:
      return WakeupReason::timer;
    case WaitResult::signalled:
      return is_guard ? WakeupReason::guard : WakeupReason::data;
    default:
      return WakeupReason::spurious;
  }
}

}  // namespace

void SerialLoop::on_ready(Callback& callback) noexcept {
  callback.mark_ready();
  wakeup_.notify();
}

void SerialLoop::add(std::shared_ptr<Callback> callback) {
  Callback& added = *callback;
  {
    const std::lock_guard lock{mutex_};
    wanted_.push_back(std::move(callback));
    wanted_version_.fetch_add(1, std::memory_order_release);
  }
  added.serve(this);
  wakeup_.notify();
}

void SerialLoop::remove(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  std::unique_lock lock{mutex_};
  std::erase_if(wanted_, [&callbacks](const auto& callback) {
    return std::ranges::find(callbacks, callback) != callbacks.end();
  });
  const std::uint64_t version = wanted_version_.fetch_add(1, std::memory_order_release) + 1;
  wakeup_.notify();
  adopted_.wait(lock, [this, version] {
    return served_version_.load(std::memory_order_acquire) >= version ||
           runner_.load(std::memory_order_acquire) == std::thread::id{};
  });
}

void SerialLoop::stop() noexcept {
  is_stopped_.store(true, std::memory_order_release);
  wakeup_.notify();
}

bool SerialLoop::is_on_own_thread() const noexcept {
  return runner_.load(std::memory_order_acquire) == std::this_thread::get_id();
}

bool SerialLoop::has_changed() const noexcept {
  return served_version_.load(std::memory_order_relaxed) !=
         wanted_version_.load(std::memory_order_acquire);
}

void SerialLoop::adopt_changes() {
  const std::lock_guard lock{mutex_};
  served_ = wanted_;
  served_version_.store(wanted_version_.load(std::memory_order_relaxed), std::memory_order_release);
  adopted_.notify_all();
}

bool SerialLoop::pass() {
  bool has_run = false;
  for (const auto& callback : served_) {
    if (is_stopped_.load(std::memory_order_acquire) || has_changed()) return true;
    // A timer needs no mark: execute_one() looks at the clock itself.
    if (!callback->take_ready_mark() && callback->next_due() == kNever) continue;
    if (!execute(*callback, failures_)) continue;
    has_run = true;
    if (callback->next_due() == kNever) callback->mark_ready();  // there may be more in its queue
  }
  return has_run;
}

std::int64_t SerialLoop::next_due() const noexcept {
  std::int64_t next = kNever;
  for (const auto& callback : served_)
    next = std::min(next, callback->next_due());
  return next;
}

void SerialLoop::run(std::int64_t deadline_ns) {
  {
    const std::lock_guard lock{mutex_};
    runner_.store(std::this_thread::get_id(), std::memory_order_release);
  }
  while (!is_stopped_.load(std::memory_order_acquire)) {
    if (has_changed()) adopt_changes();
    const bool has_run = pass();
    if (deadline_ns != kNever && monotonic_now() >= deadline_ns) break;
    if (has_run) continue;
    const WaitResult result = wakeup_.wait_until(std::min(next_due(), deadline_ns));
    if (result == WaitResult::not_waited) continue;
    const bool is_guard = is_stopped_.load(std::memory_order_acquire) || has_changed();
    trace::thread_wakeup(served_.size() == 1 ? served_.front()->id() : kNoCallback,
                         reason_of(result, is_guard));
  }
  const std::lock_guard lock{mutex_};
  served_.clear();
  served_version_.store(0, std::memory_order_release);
  runner_.store(std::thread::id{}, std::memory_order_release);
  adopted_.notify_all();
}

}  // namespace cie::executor
