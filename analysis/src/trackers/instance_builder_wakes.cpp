// What woke threads, and which instance it is of.
#include "instance_builder.hpp"

#include <algorithm>

namespace cie::analysis {

void InstanceBuilder::thread_began(HostIndex host, ThreadIndex thread) {
  // A thread may be announced long after it began: what woke it since is its own.
  const auto& facts = model_.threads[at(thread)];
  const Timestamp begin{facts.start_ns.value_or(0)};
  auto& wakeup = of_thread(thread).wakeup;
  if (wakeup && *wakeup < begin) wakeup = {};
  if (!facts.is_known_to_kernel) return;
  const auto wake = timeline_.last_wake(host, facts.tid);
  if (wake.waking && *wake.waking < begin) timeline_.forget_wake(host, facts.tid);
}

void InstanceBuilder::apply(const EventHead& head, const Emitter& who, const ThreadWakeup& event) {
  if (!who.thread) return;
  auto& on_thread = of_thread(who.thread);
  on_thread.wakeup = head.time;
  on_thread.has_waited = true;
  if (event.reason == WakeupReason::spurious) on_thread.nothing_until = head.time;
  // What was due when it looked for work would have run since.
  if (!on_thread.last_activity) return;
  if (on_thread.waited_since) {
    on_thread.busy_since = std::max(on_thread.busy_since, *on_thread.waited_since);
  }
  on_thread.waited_since = on_thread.last_activity;
}

void InstanceBuilder::forget_doubtful_wakes(const EventHead& head, PendingInstance& pending,
                                            const OfThread& thread, bool follows) const {
  const auto& last = *thread.open.back();
  const auto seen = last.start.time;
  if (*thread.last_activity > seen) return;  // the thread ended something since
  const auto is_same = [&pending](const auto& run) { return run->callback == pending.callback; };
  const bool has_ended =
      !is_reentrant(pending.callback) && std::ranges::any_of(thread.open, is_same);
  if (!has_ended && !may_have_ended(head, last)) return;
  const auto& losses = recording_.loss_times();
  const auto is_loss_since = [&](Timestamp wake) {
    return losses.any_between(pending.host, wake, head.time);
  };
  const auto is_behind_loss = [&](const OptionalTime& wake) {
    return wake && *wake > seen && losses.any_between(pending.host, seen, *wake) &&
           !is_loss_since(*wake);
  };
  // An executor waits where no instance runs, and none is missing that ran since.
  const bool is_isolated = pending.thread_facts->role == ThreadRole::callback;
  const bool has_waited = follows && pending.wakeup && *pending.wakeup > seen &&
                          (is_isolated || !is_loss_since(*pending.wakeup));
  // Only that of an isolated thread certainly slept: the last wake-up of all ended its wait.
  if (!(has_waited && is_isolated) && !is_behind_loss(pending.wake.waking)) pending.wake = {};
  if (!has_waited && !is_behind_loss(pending.wakeup)) pending.wakeup = {};
}

}  // namespace cie::analysis
