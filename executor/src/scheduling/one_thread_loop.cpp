#include <cie/scheduling/one_thread_loop.hpp>
#include <cie/tracepoints/trace.hpp>

#include "wakeup_reason.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

namespace cie::scheduling {

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

std::uint64_t OneThreadLoop::take_out(const Callbacks& callbacks) {
  std::erase_if(wanted_, [&callbacks](const auto& callback) {
    return std::ranges::find(callbacks, callback) != callbacks.end();
  });
  gone_.insert(gone_.end(), callbacks.begin(), callbacks.end());
  const std::uint64_t version = wanted_version_.fetch_add(1, std::memory_order_release) + 1;
  wakeup_.notify();
  return version;
}

void OneThreadLoop::remove(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  Callbacks forgotten;
  std::unique_lock lock{mutex_};
  const std::uint64_t version = take_out(callbacks);
  adopted_.wait(lock, [this, version] {
    return served_version_.load(std::memory_order_acquire) >= version ||
           runner_.load(std::memory_order_acquire) == std::thread::id{};
  });
  if (runner_.load(std::memory_order_acquire) == std::thread::id{}) forgotten = forget_gone();
  lock.unlock();
}

void OneThreadLoop::abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  Callbacks forgotten;
  std::unique_lock lock{mutex_};
  take_out(callbacks);
  if (runner_.load(std::memory_order_acquire) == std::thread::id{}) forgotten = forget_gone();
  lock.unlock();
}

OneThreadLoop::Callbacks OneThreadLoop::forget_gone() {
  if (!gone_.empty()) forget(gone_);
  return std::exchange(gone_, {});
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

// Who waits in remove() may rely on it that this thread holds nothing of what went.
void OneThreadLoop::adopt_changes() {
  std::uint64_t version = 0;
  {
    Callbacks forgotten;
    Callbacks former;
    const std::lock_guard lock{mutex_};
    forgotten = forget_gone();
    former.swap(served_);
    served_ = wanted_;
    adopt();
    version = wanted_version_.load(std::memory_order_relaxed);
  }
  const std::lock_guard lock{mutex_};
  served_version_.store(version, std::memory_order_release);
  adopted_.notify_all();
}

void OneThreadLoop::run(std::int64_t deadline_ns) {
  {
    const std::lock_guard lock{mutex_};
    runner_.store(std::this_thread::get_id(), std::memory_order_release);
  }
  while (!is_over()) {
    if (has_changed()) adopt_changes();
    const bool has_run = pass();
    if (deadline_ns != kNever && monotonic_now() >= deadline_ns) break;
    if (has_run) continue;
    const std::int64_t until = std::min(next_due(), deadline_ns);
    trace::thread_wait(until);
    const WaitResult result = wakeup_.wait_until(until);
    if (result == WaitResult::not_waited) continue;
    const bool is_guard = is_interrupted();
    trace::thread_wakeup(served_.size() == 1 ? served_.front()->id() : kNoCallback,
                         reason_of(result, is_guard));
  }
  {
    Callbacks former;
    const std::lock_guard lock{mutex_};
    former.swap(served_);
    adopt();
  }
  Callbacks forgotten;
  const std::lock_guard lock{mutex_};
  forgotten = forget_gone();
  served_version_.store(0, std::memory_order_release);
  runner_.store(std::thread::id{}, std::memory_order_release);
  adopted_.notify_all();
}

}  // namespace cie::scheduling
