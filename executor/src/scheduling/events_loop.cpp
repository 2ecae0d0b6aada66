#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/events_loop.hpp>

#include <algorithm>
#include <utility>

namespace cie::scheduling {

void EventsLoop::on_ready(Callback& callback) noexcept {
  if (!callback.try_mark_ready()) return;  // it is in the queue, and whoever put it there notified
  Callback* head = arrived_.load(std::memory_order_relaxed);
  do {
    callback.set_next_ready(head);
  } while (!arrived_.compare_exchange_weak(head, &callback, std::memory_order_release,
                                           std::memory_order_relaxed));
  wake();
}

void EventsLoop::append(Callback& callback) noexcept {
  callback.set_next_ready(nullptr);
  if (last_ == nullptr) {
    first_ = &callback;
  } else {
    last_->set_next_ready(&callback);
  }
  last_ = &callback;
}

Callback* EventsLoop::pop() noexcept {
  Callback* const callback = first_;
  if (callback == nullptr) return nullptr;
  first_ = callback->next_ready();
  if (first_ == nullptr) last_ = nullptr;
  return callback;
}

void EventsLoop::collect() noexcept {
  if (arrived_.load(std::memory_order_relaxed) == nullptr) return;
  Callback* latest_first = arrived_.exchange(nullptr, std::memory_order_acquire);
  Callback* oldest_first = nullptr;
  while (latest_first != nullptr) {
    Callback* const next = latest_first->next_ready();
    latest_first->set_next_ready(std::exchange(oldest_first, latest_first));
    latest_first = next;
  }
  while (oldest_first != nullptr)
    append(*std::exchange(oldest_first, oldest_first->next_ready()));
}

void EventsLoop::collect_due() noexcept {
  if (timed_.empty()) return;
  const std::int64_t now = monotonic_now();
  for (Callback* const callback : timed_) {
    if (callback->next_due() <= now && callback->try_mark_ready()) append(*callback);
  }
}

// One event: so a stream of them cannot keep the loop from seeing that it is to stop or to change.
bool EventsLoop::pass() {
  collect();
  collect_due();
  Callback* const callback = pop();
  if (callback == nullptr) return false;
  callback->take_ready_mark();
  // There may be more in its queue: to the end of ours, unless a new arrival put it there.
  if (run_instance(*callback) && callback->has_queue() && callback->try_mark_ready()) {
    append(*callback);
  }
  return true;
}

std::int64_t EventsLoop::next_due() const noexcept {
  std::int64_t next = kNever;
  for (const Callback* const callback : timed_)
    next = std::min(next, callback->next_due());
  return next;
}

void EventsLoop::adopt() {
  timed_.clear();
  for (const auto& callback : served()) {
    if (callback->has_timer()) timed_.push_back(callback.get());
  }
}

void EventsLoop::forget(const Callbacks& gone) {
  collect();
  Callback* queued = std::exchange(first_, nullptr);
  last_ = nullptr;
  while (queued != nullptr) {
    Callback& callback = *std::exchange(queued, queued->next_ready());
    const bool is_gone = std::ranges::any_of(
        gone, [&callback](const auto& each) { return each.get() == &callback; });
    if (is_gone) {
      callback.take_ready_mark();
    } else {
      append(callback);
    }
  }
}

}  // namespace cie::scheduling
