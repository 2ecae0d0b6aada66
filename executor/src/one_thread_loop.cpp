#include "one_thread_loop.hpp"

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

void OneThreadLoop::add(std::shared_ptr<Callback> callback) {
  Callback& added = *callback;
  added.take_ready_mark();  // another loop's
  {
    const std::lock_guard lock{mutex_};
    wanted_.push_back(std::move(callback));
    wanted_version_.fetch_add(1, std::memory_order_release);
  }
  added.serve(this);
  wakeup_.notify();
}

void OneThreadLoop::remove(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  std::unique_lock lock{mutex_};
  std::erase_if(wanted_, [&callbacks](const auto& callback) {
    return std::ranges::find(callbacks, callback) != callbacks.end();
  });
  gone_.insert(gone_.end(), callbacks.begin(), callbacks.end());
  const std::uint64_t version = wanted_version_.fetch_add(1, std::memory_order_release) + 1;
  wakeup_.notify();
  adopted_.wait(lock, [this, version] {
    return served_version_.load(std::memory_order_acquire) >= version ||
           runner_.load(std::memory_order_acquire) == std::thread::id{};
  });
  if (runner_.load(std::memory_order_acquire) == std::thread::id{}) forget_gone();
}

void OneThreadLoop::forget_gone() {
  if (gone_.empty()) return;
  forget(gone_);
  gone_.clear();
}

void OneThreadLoop::stop() noexcept {
  is_stopped_.store(true, std::memory_order_release);
  wakeup_.notify();
}

bool OneThreadLoop::is_on_own_thread() const noexcept {
  return runner_.load(std::memory_order_acquire) == std::this_thread::get_id();
}

bool OneThreadLoop::has_changed() const noexcept {
  return served_version_.load(std::memory_order_relaxed) !=
         wanted_version_.load(std::memory_order_acquire);
}

void OneThreadLoop::adopt_changes() {
  const std::lock_guard lock{mutex_};
  forget_gone();
  served_ = wanted_;
  adopt();
  served_version_.store(wanted_version_.load(std::memory_order_relaxed), std::memory_order_release);
  adopted_.notify_all();
}

void OneThreadLoop::run(std::int64_t deadline_ns) {
  {
    const std::lock_guard lock{mutex_};
    runner_.store(std::this_thread::get_id(), std::memory_order_release);
  }
  while (!is_stopped_.load(std::memory_order_acquire)) {
    if (has_changed()) adopt_changes();
    const bool has_run = pass();
    if (deadline_ns != kNever && monotonic_now() >= deadline_ns) break;
    if (has_run) continue;
    const std::int64_t until = std::min(next_due(), deadline_ns);
    trace::thread_wait(until);
    const WaitResult result = wakeup_.wait_until(until);
    if (result == WaitResult::not_waited) continue;
    const bool is_guard = is_stopped_.load(std::memory_order_acquire) || has_changed();
    trace::thread_wakeup(served_.size() == 1 ? served_.front()->id() : kNoCallback,
                         reason_of(result, is_guard));
  }
  const std::lock_guard lock{mutex_};
  served_.clear();
  adopt();
  served_version_.store(0, std::memory_order_release);
  runner_.store(std::thread::id{}, std::memory_order_release);
  adopted_.notify_all();
}

}  // namespace cie::executor
