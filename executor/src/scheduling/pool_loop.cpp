#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/pool_loop.hpp>
#include <cie/tracepoints/trace.hpp>

#include "wakeup_reason.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

namespace cie::scheduling {

void PoolLoop::on_ready(Callback& callback) noexcept {
  callback.mark_ready();
  work_.notify_one();
}

void PoolLoop::add(std::shared_ptr<Callback> callback) {
  auto served = std::make_unique<Served>();
  served->callback = std::move(callback);
  served->callback->serve(this);
  {
    const std::lock_guard lock{mutex_};
    const auto same_group =
        std::ranges::find(served_, &served->callback->group(),
                          [](const ServedPtr& each) { return &each->callback->group(); });
    served->running_of_group =
        same_group == served_.end() ? std::make_shared<int>(0) : (*same_group)->running_of_group;
    served_.push_back(std::move(served));
  }
  work_.notify_all();  // the leader's timer may be another one now
}

void PoolLoop::remove(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  std::unique_lock lock{mutex_};
  for (const auto& served : served_) {
    if (std::ranges::find(callbacks, served->callback) != callbacks.end()) {
      served->is_removed = true;
    }
  }
  finished_.wait(lock, [this] {
    return std::ranges::none_of(
        served_, [](const auto& s) { return s->is_removed && !s->is_abandoned && s->running > 0; });
  });
  const auto gone = take_idle_removed();
  lock.unlock();
}

void PoolLoop::abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  std::unique_lock lock{mutex_};
  for (const auto& served : served_) {
    if (std::ranges::find(callbacks, served->callback) != callbacks.end()) {
      served->is_removed = true;
      served->is_abandoned = true;
    }
  }
  finished_.notify_all();  // somebody may have begun to wait for one of them
  const auto gone = take_idle_removed();
  lock.unlock();
}

std::vector<PoolLoop::ServedPtr> PoolLoop::take_idle_removed() {
  std::vector<ServedPtr> gone;
  for (ServedPtr& served : served_) {
    if (served->is_removed && served->running == 0) gone.push_back(std::move(served));
  }
  std::erase(served_, nullptr);
  return gone;
}

void PoolLoop::stop() noexcept {
  is_stopped_.store(true);
  work_.notify_all();
}

void PoolLoop::wake() noexcept { work_.notify_all(); }

bool PoolLoop::is_on_own_thread() const noexcept {
  const std::lock_guard lock{mutex_};
  return std::ranges::find(runners_, std::this_thread::get_id()) != runners_.end();
}

bool PoolLoop::may_overlap(const Served& served) noexcept {
  return served.callback->group().type() == GroupType::reentrant;
}

bool PoolLoop::is_blocked(const Served& served) noexcept {
  return !may_overlap(served) && *served.running_of_group > 0;
}

PoolLoop::Served* PoolLoop::pick() {
  const std::int64_t now = monotonic_now();
  for (std::size_t i = 0; i < served_.size(); ++i) {
    Served& served = *served_[(turn_ + i) % served_.size()];
    Callback& callback = *served.callback;
    if (served.is_removed || is_blocked(served)) continue;
    // The mark stands for all that arrived before it was taken.
    const bool has_more = may_overlap(served) && callback.queued() > 0;
    if (!callback.take_ready_mark() && !has_more && callback.next_due() > now) continue;
    turn_ = (turn_ + i + 1) % served_.size();
    ++served.running;
    ++*served.running_of_group;
    return &served;
  }
  return nullptr;
}

PoolLoop::ServedPtr PoolLoop::finish(Served& served, bool has_run) {
  Callback& callback = *served.callback;
  if (has_run && callback.has_queue()) callback.mark_ready();  // there may be more in it
  --*served.running_of_group;
  if (--served.running == 0 && served.is_removed) finished_.notify_all();
  // The leader may have gone to sleep while this timer was blocked by its own instance.
  if (has_leader_ && next_due() < leader_until_ns_) work_.notify_all();
  if (!served.is_abandoned || served.running > 0) return nullptr;
  const auto place = std::ranges::find(served_, &served, &ServedPtr::get);
  ServedPtr gone = std::move(*place);
  served_.erase(place);
  return gone;
}

std::int64_t PoolLoop::next_due() const {
  const std::int64_t now = monotonic_now();
  std::int64_t next = kNever;
  for (const auto& served : served_) {
    const std::int64_t due = served->callback->next_due();
    // What is due and blocked is picked by the thread that ends the blocking.
    if (!served->is_removed && (due > now || !is_blocked(*served))) next = std::min(next, due);
  }
  return next;
}

void PoolLoop::wait(std::unique_lock<PriorityMutex>& lock, EventCount::Ticket ticket,
                    std::int64_t deadline_ns) {
  const bool is_leader = !has_leader_;
  const std::int64_t until = is_leader ? std::min(next_due(), deadline_ns) : deadline_ns;
  if (is_leader) leader_until_ns_ = until;
  has_leader_ = true;
  ++idle_;
  lock.unlock();
  trace::thread_wait(until);
  const WaitResult result = work_.wait_until(ticket, until);
  if (result != WaitResult::not_waited)
    trace::thread_wakeup(kNoCallback, reason_of(result, is_over()));
  lock.lock();
  --idle_;
  if (is_leader) has_leader_ = false;
}

// What comes to pass after the ticket ends the wait: so it is taken before the thread looks.
void PoolLoop::run(std::int64_t deadline_ns) {
  std::unique_lock lock{mutex_};
  runners_.push_back(std::this_thread::get_id());
  for (;;) {
    const EventCount::Ticket ticket = work_.ticket();
    if (is_over() || (deadline_ns != kNever && monotonic_now() >= deadline_ns)) break;
    Served* const served = pick();
    if (served == nullptr) {
      wait(lock, ticket, deadline_ns);
      continue;
    }
    // Somebody idle takes over the lead, and with it whatever else is ready.
    const bool can_share = may_overlap(*served) && served->callback->queued() > 1;
    if (idle_ > 0 && (!has_leader_ || can_share)) work_.notify_one();
    lock.unlock();
    const bool has_run = execute(*served->callback, parts_);
    lock.lock();
    if (ServedPtr gone = finish(*served, has_run)) {
      lock.unlock();
      gone.reset();
      lock.lock();
    }
  }
  std::erase(runners_, std::this_thread::get_id());
}

}  // namespace cie::scheduling
