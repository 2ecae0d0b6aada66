#include "wait_set_loop.hpp"

#include <cie/scheduling/clock.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dispatch/reader_callback.hpp"
#include "scheduling_names.hpp"

#include <algorithm>
#include <utility>

namespace cie::executor {
namespace {

// What a triggered entity is attached with: nothing but the loop's own interrupt, or two for each
// slot attached.
constexpr dds_attach_t kInterrupt = 0;
constexpr dds_attach_t kPerSlot = 2;

// Triggered while messages wait; without a handle for what takes no messages.
dds::Entity read_condition_of(const Callback& callback) {
  const auto* const reading = dynamic_cast<const ReaderCallback*>(&callback);
  return reading == nullptr ? dds::Entity{} : reading->reader().new_read_condition();
}

dds::Entity new_guard() {
  return {dds_create_guardcondition(DDS_CYCLONEDDS_HANDLE), "creating the guard condition",
          "an executor"};
}

}  // namespace

// The guard condition is set by triggers, by timers that begin anew and by readers for which a service
// has a response; a plain subscription needs none, its read condition is triggered as long as a message
// waits.
struct WaitSetLoop::Slot final : ReadySink {
  explicit Slot(std::shared_ptr<Callback> served)
      : callback(std::move(served)), data(read_condition_of(*callback)) {
    if (data.get() == 0 || callback->has_timer() || callback->kind() == CallbackKind::service)
      guard = new_guard();
  }
  void on_ready(Callback&) noexcept override {
    if (guard.get() != 0) dds_set_guardcondition(guard.get(), true);
  }

  std::shared_ptr<Callback> callback;
  dds::Entity data;
  dds::Entity guard;
  // With mutex_ held.
  bool is_ready = false;
  bool is_removed = false;
  bool is_abandoned = false;  // nobody waits: whoever runs it last deletes it
  int running = 0;
};

WaitSetLoop::WaitSetLoop(const LoopParts& parts)
    : parts_(parts),
      interrupt_(new_guard()),
      wait_set_(dds_create_waitset(DDS_CYCLONEDDS_HANDLE), "creating the wait set", "an executor"),
      results_(1) {
  dds::check(dds_waitset_attach(wait_set_.get(), interrupt_.get(), kInterrupt),
             "attaching the guard condition", "an executor");
}

WaitSetLoop::~WaitSetLoop() { attach({}); }

void WaitSetLoop::interrupt() noexcept { dds_set_guardcondition(interrupt_.get(), true); }

void WaitSetLoop::add(std::shared_ptr<Callback> callback) {
  auto slot = std::make_unique<Slot>(std::move(callback));
  Slot& added = *slot;
  {
    const std::lock_guard lock{mutex_};
    const auto kind = [](const SlotPtr& each) { return each->callback->kind(); };
    slots_.insert(std::ranges::upper_bound(slots_, added.callback->kind(), {}, kind),
                  std::move(slot));
  }
  added.callback->serve(&added);
  interrupt();
}

void WaitSetLoop::mark_removed(const std::vector<std::shared_ptr<Callback>>& callbacks,
                               bool is_abandoned) {
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
  {
    const std::lock_guard lock{mutex_};
    ++changing_;
  }
  interrupt();
  const std::lock_guard turn{turn_};  // nobody waits
  const std::lock_guard lock{mutex_};
  attach({});
  for (const SlotPtr& slot : slots_) {
    if (std::ranges::find(callbacks, slot->callback) == callbacks.end()) continue;
    slot->is_removed = true;
    slot->is_abandoned |= is_abandoned;
  }
  --changing_;
  changed_.notify_all();
}

std::vector<WaitSetLoop::SlotPtr> WaitSetLoop::take_idle_removed() {
  std::vector<SlotPtr> gone;
  for (SlotPtr& slot : slots_) {
    if (slot->is_removed && slot->running == 0) gone.push_back(std::move(slot));
  }
  std::erase(slots_, nullptr);
  return gone;
}

void WaitSetLoop::remove(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  mark_removed(callbacks, false);
  std::unique_lock lock{mutex_};
  changed_.wait(lock, [this] {
    return std::ranges::none_of(slots_, [](const SlotPtr& slot) {
      return slot->is_removed && !slot->is_abandoned && slot->running > 0;
    });
  });
  const auto gone = take_idle_removed();
  lock.unlock();
}

void WaitSetLoop::abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  mark_removed(callbacks, true);
  std::unique_lock lock{mutex_};
  const auto gone = take_idle_removed();
  lock.unlock();
}

void WaitSetLoop::stop() noexcept {
  is_stopped_.store(true, std::memory_order_release);
  interrupt();
}

bool WaitSetLoop::is_on_own_thread() const noexcept {
  const std::lock_guard lock{mutex_};
  return std::ranges::find(runners_, std::this_thread::get_id()) != runners_.end();
}

bool WaitSetLoop::is_over(std::int64_t deadline_ns) const noexcept {
  return is_stopped_.load(std::memory_order_acquire) || parts_.cancellation.is_cancelled() ||
         (deadline_ns != kNever && monotonic_now() >= deadline_ns);
}

bool WaitSetLoop::is_blocked(const Slot& slot) const {
  const GroupState& group = slot.callback->group();
  if (group.type() == GroupType::reentrant) return false;
  return running_of_group_.contains(&group);
}

WaitSetLoop::Slot* WaitSetLoop::take_ready() {
  for (const SlotPtr& slot : slots_) {
    if (!slot->is_ready || slot->is_removed || is_blocked(*slot)) continue;
    slot->is_ready = false;
    ++slot->running;
    ++running_of_group_[&slot->callback->group()];
    return slot.get();
  }
  return nullptr;
}

// Attaches anew only if the set is another one, as rmw_cyclonedds does.
void WaitSetLoop::attach(const std::vector<Slot*>& slots) {
  if (slots == attached_) return;
  const auto each = [](const std::vector<Slot*>& of, auto act) {
    for (std::size_t i = 0; i < of.size(); ++i) {
      const auto first = static_cast<dds_attach_t>(1 + i * kPerSlot);
      if (of[i]->guard.get() != 0) act(of[i]->guard.get(), first);
      if (of[i]->data.get() != 0) act(of[i]->data.get(), first + 1);
    }
  };
  each(attached_,
       [this](dds_entity_t entity, dds_attach_t) { dds_waitset_detach(wait_set_.get(), entity); });
  each(slots, [this](dds_entity_t entity, dds_attach_t name) {
    dds_waitset_attach(wait_set_.get(), entity, name);
  });
  attached_ = slots;
  results_.resize(1 + slots.size() * kPerSlot);
}

// What may run, and when the first timer of it is due.
std::int64_t WaitSetLoop::collect() {
  collected_.clear();
  std::int64_t due = kNever;
  for (const SlotPtr& slot : slots_) {
    if (slot->is_removed || is_blocked(*slot)) continue;
    collected_.push_back(slot.get());
    due = std::min(due, slot->callback->next_due());
  }
  attach(collected_);
  return due;
}

void WaitSetLoop::note(dds_attach_t triggered) {
  bool was_set = false;
  if (triggered == kInterrupt) {
    dds_take_guardcondition(interrupt_.get(), &was_set);
    return;
  }
  const auto index = static_cast<std::size_t>(triggered - 1);
  Slot& slot = *attached_[index / kPerSlot];
  slot.is_ready = true;
  if (index % kPerSlot == 0) dds_take_guardcondition(slot.guard.get(), &was_set);
}

void WaitSetLoop::wait_for_work(std::int64_t deadline_ns) {
  std::int64_t until = deadline_ns;
  {
    const std::lock_guard lock{mutex_};
    if (changing_ > 0) return;  // somebody who interrupted another's wait comes first
    until = std::min(until, collect());
  }
  trace::thread_wait(until);
  const dds_duration_t timeout =
      until == kNever ? DDS_INFINITY : std::max<std::int64_t>(until - monotonic_now(), 0);
  const dds_return_t count =
      dds_waitset_wait(wait_set_.get(), results_.data(), results_.size(), timeout);
  dds::check(count, "waiting", "an executor");
  const auto triggered = static_cast<std::size_t>(count);
  const bool has_data = std::any_of(results_.begin(), results_.begin() + count,
                                    [](dds_attach_t name) { return name != kInterrupt; });
  // DDS does not say whether it slept: an event for each wait.
  trace::thread_wakeup(attached_.size() == 1 ? attached_.front()->callback->id() : kNoCallback,
                       triggered == 0 ? WakeupReason::timer
                       : has_data     ? WakeupReason::data
                                      : WakeupReason::guard);
  const std::lock_guard lock{mutex_};
  for (std::size_t i = 0; i < triggered; ++i)
    note(results_[i]);
  const std::int64_t now = monotonic_now();
  for (Slot* const slot : attached_) {
    if (slot->callback->next_due() <= now) slot->is_ready = true;
  }
}

WaitSetLoop::Slot* WaitSetLoop::next(std::int64_t deadline_ns) {
  const std::lock_guard turn{turn_};
  const auto take = [this] {
    const std::lock_guard lock{mutex_};
    return take_ready();
  };
  if (is_over(deadline_ns)) return nullptr;
  if (Slot* const slot = take()) return slot;
  wait_for_work(deadline_ns);
  return is_over(deadline_ns) ? nullptr : take();
}

void WaitSetLoop::finish(Slot& slot, bool has_run) {
  // A trigger may stand for several instances where no read condition tells what is left.
  if (has_run && slot.data.get() == 0 && slot.callback->has_queue()) slot.on_ready(*slot.callback);
  std::vector<SlotPtr> gone;  // after the lock
  {
    const std::lock_guard lock{mutex_};
    const auto group = running_of_group_.find(&slot.callback->group());
    if (--group->second == 0) running_of_group_.erase(group);
    if (--slot.running == 0 && slot.is_removed) {
      if (slot.is_abandoned) gone = take_idle_removed();
      changed_.notify_all();
    }
  }
  interrupt();  // what the instance blocked may run now
}

void WaitSetLoop::run(std::int64_t deadline_ns) {
  const auto self = std::this_thread::get_id();
  {
    const std::lock_guard lock{mutex_};
    runners_.push_back(self);
  }
  while (!is_over(deadline_ns)) {
    {
      std::unique_lock lock{mutex_};
      changed_.wait(lock, [this] { return changing_ == 0; });
    }
    Slot* const slot = next(deadline_ns);
    if (slot != nullptr) finish(*slot, execute(*slot->callback, parts_));
  }
  const std::lock_guard lock{mutex_};
  std::erase(runners_, self);
}

}  // namespace cie::executor
