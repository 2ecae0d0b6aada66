// The scheduler's decisions: ranks, budgets and slices, inheritance, and who gets which processor.
#include "simulator/machine.hpp"

#include <algorithm>
#include <utility>

namespace cie::sim {
namespace {

constexpr Range kRetry{1, 2'000};  // from losing a processor to trying another one

// Of `prev_state`: TASK_INTERRUPTIBLE, TASK_UNINTERRUPTIBLE, TASK_DEAD (linux/sched.h).
constexpr std::int64_t kInterruptible = 1;
constexpr std::int64_t kUninterruptible = 2;
constexpr std::int64_t kDead = 0x80;
constexpr std::int64_t kPreempted = 0x100;

}  // namespace

Machine::Rank Machine::own_rank(const Thread& thread) const {
  const auto& parameters = thread.parameters;
  switch (*parameters.policy) {
    case Policy::deadline:
      return {.band = 0, .key = thread.deadline, .order = thread.order};
    case Policy::fifo:
    case Policy::round_robin:
      return {.band = 1, .key = 99 - static_cast<Ns>(parameters.priority), .order = thread.order};
    case Policy::other:
    case Policy::batch:
    case Policy::idle:
      return {.band = 2, .key = 0, .order = thread.order};
  }
  return {};
}

Machine::Rank Machine::rank(const Thread& thread) const {
  const auto own = own_rank(thread);
  return thread.inherited ? std::min(own, *thread.inherited) : own;
}

// The kernel's number: -1, 99 - priority, 120 + nice.
std::int32_t Machine::priority(const Thread& thread) const {
  const auto effective = rank(thread);
  if (effective.band == 0) return -1;
  if (effective.band == 1) return static_cast<std::int32_t>(effective.key);
  return 120 + thread.parameters.nice;
}

bool Machine::is_allowed(const Thread& thread, std::int32_t cpu) {
  const auto& cpus = thread.parameters.cpus;
  return !cpus || std::ranges::find(*cpus, static_cast<std::uint32_t>(cpu)) != cpus->end();
}

void Machine::expire(ThreadNumber number) {
  auto& thread = threads_[number];
  const auto policy = *thread.parameters.policy;
  if (policy == Policy::deadline) {
    if (thread.budget > 0 || thread.inherited || thread.is_throttled) return;
    thread.is_throttled = true;
    const auto next = thread.deadline - static_cast<Ns>(thread.parameters.deadline_ns) +
                      static_cast<Ns>(thread.parameters.period_ns);
    at(std::max(next, now_ + 1), [this, number] { replenish(number); });
    needs_dispatch_ = true;
  } else if (policy != Policy::fifo && thread.slice <= 0) {
    thread.slice = kSlice;
    thread.order = queue_order_++;
    needs_dispatch_ = true;
  }
}

void Machine::replenish(ThreadNumber number) {
  auto& thread = threads_[number];
  thread.is_throttled = false;
  thread.budget = static_cast<Ns>(thread.parameters.runtime_ns);
  thread.deadline = now_ + static_cast<Ns>(thread.parameters.deadline_ns);
  needs_dispatch_ = true;
}

void Machine::acquire(ThreadNumber number, int mutex) {
  auto& thread = threads_[number];
  auto& wanted = mutexes_[static_cast<std::size_t>(mutex)];
  if (!wanted.owner) {
    wanted.owner = number;
    thread.holds.push_back(mutex);
    return;
  }
  wanted.waiters.push_back(number);
  thread.wants = mutex;
  block(number, Reason::mutex);
  inherit(*wanted.owner);
}

void Machine::release(ThreadNumber number, int mutex) {
  auto& held = mutexes_[static_cast<std::size_t>(mutex)];
  std::erase(threads_[number].holds, mutex);
  held.owner.reset();
  if (!held.waiters.empty()) {
    const auto first = std::ranges::min_element(
        held.waiters, {}, [this](ThreadNumber waiter) { return rank(threads_[waiter]); });
    const auto next = *first;
    held.waiters.erase(first);
    held.owner = next;
    threads_[next].wants.reset();
    threads_[next].holds.push_back(mutex);
    inherit(number);
    inherit(next);
    wake(next, speaker_);
    return;
  }
  inherit(number);
}

// Gives a thread the best rank of the real-time threads that wait for it, and hands it on.
void Machine::inherit(ThreadNumber number) {
  auto& owner = threads_[number];
  const auto before = priority(owner);
  const bool had_inherited = owner.inherited.has_value();
  owner.inherited.reset();
  for (const auto mutex : owner.holds) {
    for (const auto waiter : mutexes_[static_cast<std::size_t>(mutex)].waiters) {
      auto offered = rank(threads_[waiter]);
      if (offered.band == 2 || !(offered < own_rank(owner))) continue;
      offered.order = owner.order;
      owner.inherited = owner.inherited ? std::min(*owner.inherited, offered) : offered;
    }
  }
  const auto after = priority(owner);
  if (before != after) {
    ++inherited_;
    inherited_at_ = now_;
    tape_.kernel(now_, std::max(speaker_, 0),
                 analysis::SchedPiSetprio{.tid = owner.tid, .old_prio = before, .new_prio = after});
  }
  if (had_inherited != owner.inherited.has_value() || before != after) needs_dispatch_ = true;
  if (owner.wants) inherit(*mutexes_[static_cast<std::size_t>(*owner.wants)].owner);
}

void Machine::dispatch() {
  needs_dispatch_ = false;
  if (inherited_at_ == now_) {  // processors notice a new priority after it was given
    at(now_ + 1, [this] { needs_dispatch_ = true; });
    return;
  }
  std::vector<ThreadNumber> ready;
  for (ThreadNumber i = 0; i < threads_.size(); ++i) {
    const auto& thread = threads_[i];
    const bool is_ready = thread.state == State::running || thread.state == State::woken ||
                          thread.state == State::preempted;
    if (is_ready && (!thread.is_throttled || thread.inherited)) ready.push_back(i);
  }
  std::ranges::sort(ready, {}, [this](ThreadNumber i) { return rank(threads_[i]); });
  std::vector<std::optional<ThreadNumber>> chosen(on_cpu_.size());
  std::vector<bool> is_taken(on_cpu_.size());
  for (const auto number : ready) {
    const auto& thread = threads_[number];
    // What happens to a thread takes time: it is not woken or displaced and running at once.
    const bool is_displaced =
        thread.state == State::running
            ? !is_allowed(thread, thread.cpu) || is_taken[static_cast<std::size_t>(thread.cpu)]
            : thread.left_at == now_ || thread.wake_up.wakeup == now_;
    if (is_displaced) {
      at(now_ + random_.in(kRetry), [this] { needs_dispatch_ = true; });
      continue;
    }
    const auto cpu = place(number, is_taken);
    if (!cpu) continue;
    is_taken[static_cast<std::size_t>(*cpu)] = true;
    chosen[static_cast<std::size_t>(*cpu)] = number;
  }
  for (std::size_t cpu = 0; cpu < on_cpu_.size(); ++cpu) {
    if (chosen[cpu] != on_cpu_[cpu]) switch_to(static_cast<std::int32_t>(cpu), chosen[cpu]);
  }
}

// The processor for a thread, by rank: its own, an idle one, or that of the least urgent.
std::optional<std::int32_t> Machine::place(ThreadNumber number,
                                           const std::vector<bool>& is_taken) const {
  const auto& thread = threads_[number];
  if (thread.state == State::running) return thread.cpu;
  std::optional<std::int32_t> best;
  Rank displaced{.band = 0, .key = 0, .order = 0};  // the one that would make way
  for (std::size_t i = 0; i < on_cpu_.size(); ++i) {
    const auto cpu = static_cast<std::int32_t>(i);
    if (is_taken[i] || !is_allowed(thread, cpu)) continue;
    const bool is_idle = !on_cpu_[i] || threads_[*on_cpu_[i]].state != State::running;
    const auto occupant = is_idle ? Rank{.band = 3, .key = cpu == thread.cpu ? 1 : 0, .order = 0}
                                  : rank(threads_[*on_cpu_[i]]);
    if (best && occupant <= displaced) continue;
    best = cpu;
    displaced = occupant;
  }
  return best;
}

void Machine::switch_to(std::int32_t cpu, std::optional<ThreadNumber> next) {
  auto& current = on_cpu_[static_cast<std::size_t>(cpu)];
  const auto idle = "swapper/" + std::to_string(cpu);
  analysis::SchedSwitch event{.prev_comm = tape_.keep(idle),
                              .prev_tid = 0,
                              .prev_prio = 120,
                              .prev_state = 0,
                              .next_comm = tape_.keep(idle),
                              .next_tid = 0,
                              .next_prio = 120};
  if (current) {
    auto& prev = threads_[*current];
    event.prev_comm = tape_.keep(prev.comm);
    event.prev_tid = prev.tid;
    event.prev_prio = priority(prev);
    if (prev.state == State::running) {
      prev.state = State::preempted;
      event.prev_state = random_.one_in(2) ? kPreempted : 0;
    } else if (prev.state == State::dead) {
      event.prev_state = kDead;
    } else {
      event.prev_state = prev.reason == Reason::sleep ? kUninterruptible : kInterruptible;
      if (!prev.first_wait) prev.first_wait = {now_, prev.account.execution};
    }
    prev.left_at = now_;
  }
  if (next) {
    auto& thread = threads_[*next];
    event.next_comm = tape_.keep(thread.comm);
    event.next_tid = thread.tid;
    event.next_prio = priority(thread);
    if (thread.cpu != cpu) {
      tape_.kernel(
          now_, cpu,
          analysis::SchedMigrateTask{.tid = thread.tid, .orig_cpu = thread.cpu, .dest_cpu = cpu});
    }
    thread.cpu = cpu;
    thread.state = State::running;
    auto& wake_up = thread.wake_up;
    if (wake_up.waking && !wake_up.first_in) wake_up.first_in = now_;
    if (wake_up.wakeup && !wake_up.first_in_runnable) wake_up.first_in_runnable = now_;
  }
  tape_.kernel(now_, cpu, event);
  current = next;
}

}  // namespace cie::sim
