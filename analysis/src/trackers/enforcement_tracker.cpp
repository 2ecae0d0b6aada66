#include "enforcement_tracker.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxForks = 65'536;  // that are kept whatever comes of them
constexpr std::size_t kMaxScheduled = 1'024;
constexpr std::size_t kMostCpus = 4096;  // no machine has more; a forged recording may
// Of `prev_state`: a task that never runs again (EXIT_DEAD, EXIT_ZOMBIE).
constexpr std::uint64_t kDead = 0x30;

// Of a priority that changes all the time, what counts is how it began and how it ended: the last two
// stretches become one.
void join_last_two(std::vector<ScheduledAs>& stretches) {
  const auto last = std::move(stretches.back());
  stretches.pop_back();
  auto& joined = stretches.back();
  joined.last = last.last;
  for (const auto& used : last.cpus) {
    note_cpu(joined.cpus, used.first);
    note_cpu(joined.cpus, used.last);
  }
}

}  // namespace

void EnforcementTracker::check_cpu(const EventHead& head, ThreadIndex index, bool is_switch) {
  auto& state = threads_[index];
  auto& place = places_[index];
  if (!is_judging_ || !head.cpu || !place.is_bound() || state.is_changing) return;
  auto& thread = model_.threads[at(index)];
  ++thread.cpus_checked;
  if (is_switch) ++thread.switch_cpus_checked;
  const auto& cpus = thread.last_read_back->cpus;
  const bool is_allowed =
      *head.cpu >= 0 &&
      std::binary_search(cpus.begin(), cpus.end(), static_cast<std::uint32_t>(*head.cpu));
  if (is_allowed) place.cpu = *head.cpu;
  if (is_allowed || thread.cpu_violation) return;
  auto where = ref(head);
  where.tid = thread.tid;
  where.pid = model_.processes[at(thread.process)].pid;
  if (thread.last_read_back->moment == SchedMoment::initial && !is_given_parameters(thread)) {
    if (state.outside_initial.empty()) state.initial = *thread.last_read_back;
    note_outside_initial(state, where);
  } else {
    thread.cpu_violation = {*thread.last_read_back, where};
  }
}

void EnforcementTracker::note_outside_initial(OfThread& state, const EventRef& where) {
  const bool is_known = std::ranges::find(state.outside_initial, where.cpu, &EventRef::cpu) !=
                        state.outside_initial.end();
  if (!is_known && state.outside_initial.size() < kMostCpus) state.outside_initial.push_back(where);
}

void EnforcementTracker::judge_outside_initial(ThreadFacts& thread, OfThread& state,
                                               bool is_applied) {
  const auto outside = std::exchange(state.outside_initial, {});
  const auto is_explained = [&](const EventRef& where) {
    const auto& cpus = thread.applied.back().cpus;
    return std::ranges::binary_search(cpus, static_cast<std::uint32_t>(*where.cpu));
  };
  const auto first = is_applied ? std::ranges::find_if_not(outside, is_explained) : outside.begin();
  if (first != outside.end() && !thread.cpu_violation) {
    thread.cpu_violation = {*state.initial, *first};
  }
}

void EnforcementTracker::adopt_unread(const EventHead& head, ThreadIndex index) {
  auto& thread = model_.threads[at(index)];
  if (thread.scheduled.empty() && thread.read_backs.count == 0) adopt_priority(head, thread);
}

void EnforcementTracker::on_priority(const EventHead& head, HostIndex host, std::int64_t number,
                                     std::int32_t prio, OfTid& tid) {
  const auto here = ref(head);
  tid.prio = prio;
  tid.scheduled = here;
  const bool is_own = !is_inherited(head.time, prio, tid.unboosted, tid.inheritance);
  if (const auto index = registry_.thread_by_tid(host, number)) {
    auto& thread = model_.threads[at(*index)];
    auto where = here;
    where.tid = number;
    where.pid = model_.processes[at(thread.process)].pid;
    if (reference(thread) != nullptr) {
      check_priority(where, host, *index, prio);
    } else if (is_own && is_judging_ && !thread.fini && thread.read_backs.count == 0) {
      take_back(thread, tid, prio);
      note_priority(where, thread, prio);
    }
  }
  if (!is_own) return;
  if (tid.own && tid.own->prio != prio) tid.taken_back.reset();
  tid.own = SwitchPriority{.at = here, .prio = prio};
}

void EnforcementTracker::check_priority(const EventRef& where, HostIndex host, ThreadIndex index,
                                        std::int32_t shown) {
  auto& thread = model_.threads[at(index)];
  auto& state = threads_[index];
  if (thread.fini || state.is_changing) return;
  const auto& expected = *reference(thread);
  const auto own = kernel_priority(expected);
  const auto prio = without_idle_nice(expected, shown);
  if (is_inherited(where.time, prio, own, state.inheritance)) return;
  const bool is_raised = prio < own;
  if (!is_raised) {
    state.may_be_boosted = false;
    state.may_be_boosted_before = false;
    state.is_still_raised = false;
  }
  if (!is_judging_) return;
  if (!is_raised) {
    thread.perhaps_inherited.reset();
  } else if (state.may_be_boosted || may_be_boosted_before(thread, host, state)) {
    if (!thread.perhaps_inherited) thread.perhaps_inherited = {.at = where, .prio = prio};
    return;
  }
  ++thread.switches_checked;
  if (prio == own) return;
  auto& mismatch = is_raised ? thread.raised_priority : thread.lowered_priority;
  if (mismatch) return;
  mismatch = {expected, SwitchPriority{.at = where, .prio = prio}};
  state.is_still_raised = is_raised;
}

// LTTng's sched_pi_setprio gives the priority of the first waiter, and when none is left the one that the
// thread has still: as if the boost went on. What the thread runs with since then tells that it ended. Each
// change of what is inherited is told: another raised priority is the thread's own.
bool EnforcementTracker::is_inherited(Timestamp time, std::int32_t prio, std::int32_t own,
                                      Inheritance& inheritance) {
  const bool is_of_that_time = inheritance.told == time;  // in which order is not known
  if (is_of_that_time) return prio < own || (inheritance.is_boosted && prio == own);
  if (prio > inheritance.prio || prio >= own) inheritance.is_boosted = false;
  return inheritance.is_boosted && prio == inheritance.prio;
}

bool EnforcementTracker::may_be_boosted_before(const ThreadFacts& thread, HostIndex host,
                                               OfThread& state) const {
  if (!state.may_be_boosted_before) {
    const auto begin = recording_.kernel_begin(host);
    const auto born = birth_of(thread);
    state.may_be_boosted_before = !begin || !born || *born < *begin;
  }
  return *state.may_be_boosted_before;
}

void EnforcementTracker::take_back(ThreadFacts& thread, const OfTid& tid, std::int32_t prio) {
  auto& all = thread.scheduled;
  if (tid.taken_back != prio || all.empty() || all.back().first.prio != tid.own->prio) return;
  all.back().first.prio = prio;
  if (all.size() > 1 && std::prev(all.end(), 2)->first.prio == prio) join_last_two(all);
}

void EnforcementTracker::note_priority(const EventRef& where, ThreadFacts& thread,
                                       std::int32_t prio) {
  auto& all = thread.scheduled;
  if (all.empty() || all.back().first.prio != prio) {
    if (all.size() >= kMaxScheduled) join_last_two(all);
    std::uint64_t starts = 0;
    for (const auto* pair : thread.ran)
      starts += pair->starts;
    all.push_back(
        ScheduledAs{.first = {.at = where, .prio = prio}, .last = where, .starts_before = starts});
  }
  all.back().last = where;
}

void EnforcementTracker::adopt_priority(const EventHead& head, ThreadFacts& thread) {
  if (!thread.is_known_to_kernel) return;
  const auto* tid = tids_[registry_.host_of(head)].find(thread.tid);
  if (tid == nullptr || !tid->own) return;
  note_own(thread, *tid);
  auto here = *tid->scheduled;  // since then
  here.time = head.time;
  auto& cpus = thread.scheduled.back().cpus;
  for (const auto& where : {*tid->scheduled, here})
    note_cpu(cpus, where);
}

void EnforcementTracker::note_own(ThreadFacts& thread, const OfTid& tid) {
  if (!tid.own) return;
  note_priority(tid.own->at, thread, tid.own->prio);
  note_cpu(thread.scheduled.back().cpus, tid.own->at);
}

// One that was announced when it ran already may have run anything until something is read back. A
// thread of ROS 2 is not announced and reads nothing back: it begins with its first instance.
bool EnforcementTracker::has_begun_work(const ThreadFacts& thread) const {
  const auto& process = model_.processes[at(thread.process)];
  if (!thread.announced) return !thread.ran.empty() && is_ros2_only(process);
  return process.first_moment == RunMoment::start || !thread.applied.empty() || thread.first_audit;
}

void EnforcementTracker::on_switch(const EventHead& head, HostIndex host,
                                   const SchedSwitch& event) {
  has_switches_ = true;
  auto& tids = tids_[host];
  if (event.prev_tid != 0) {
    auto& prev = tids[event.prev_tid];
    on_priority(head, host, event.prev_tid, event.prev_prio, prev);
    const bool waits = (static_cast<std::uint64_t>(event.prev_state) & 0xffU) != 0;
    const bool is_dead = (static_cast<std::uint64_t>(event.prev_state) & kDead) != 0;
    if (is_dead) forget_own(prev);
    if (const auto index = registry_.thread_by_tid(host, event.prev_tid); index && waits) {
      auto& thread = model_.threads[at(*index)];
      auto& state = threads_[*index];
      if (state.foreign) {
        count_foreign_work(host, *state.foreign, reading(*index, host, head.time));
      } else if (!thread.fini && !thread.kernel_exit && has_begun_work(thread) &&
                 !instances_.is_inside_unseen(*index)) {
        begin_foreign_work(*index, reading(*index, host, head.time));
      }
      if (thread.fini || is_dead) {  // its last switch-out, unless another follows
        prev.busy_at_exit = timeline_.mark(host, event.prev_tid, head.time).total.execution;
        prev.has_left = true;
        thread.busy_ns = busy_of(state, prev, prev.busy_at_exit).ns;
      }
      if (is_dead) {
        const bool is_recorded = !thread.fini && !is_totalled_ && !state.record_end;
        if (is_recorded) total_foreign_work(*index, host, reading(*index, host, head.time));
        state.is_gone = true;
        registry_.die(head, event.prev_tid);
      }
    }
  }
  if (event.next_tid == 0) return;
  auto& next = tids[event.next_tid];
  if (next.is_new) {
    next.is_new = false;
    model_.forks[*next.fork].child_first = SwitchPriority{.at = ref(head), .prio = event.next_prio};
    if (!is_real_time_priority(event.next_prio)) forget_fork(next);
  }
  on_priority(head, host, event.next_tid, event.next_prio, next);
  if (const auto index = registry_.thread_by_tid(host, event.next_tid)) {
    auto& thread = model_.threads[at(*index)];
    if (is_judging_) {
      thread.switched_in = ref(head);
      thread.switched_in->tid = thread.tid;
    }
    if (!thread.fini) check_cpu(head, *index, true);
    if (thread.scheduled.empty()) return;
    note_cpu(thread.scheduled.back().cpus, thread.scheduled.back().last);
  }
}

void EnforcementTracker::on_fork(const EventHead& head, HostIndex host,
                                 const SchedProcessFork& event) {
  auto& tids = tids_[host];
  if (const auto former = registry_.thread_by_tid(host, event.child_tid)) {
    threads_[*former].is_gone = true;
    registry_.give_tid_anew(host, event.child_tid);
  }
  auto& child = tids[event.child_tid];
  if (child.thread && !child.has_left) {
    child.busy_at_exit = timeline_.mark(host, event.child_tid, head.time).total.execution;
    child.has_left = true;
  }
  const auto* parent = tids.find(event.parent_tid);
  child.prio = OfTid{}.prio;
  forget_own(child);
  if (child.is_new) forget_fork(child);
  child.is_new = false;
  child.fork.reset();
  if (!is_judging_) return;
  const auto thread = registry_.thread_by_tid(host, event.parent_tid);
  const auto prio = latest_priority(thread, parent);
  if (!prio || !is_real_time_priority(*prio)) return;
  const ForkFacts facts{.at = ref(head),
                        .host = host,
                        .parent_tid = event.parent_tid,
                        .child_tid = event.child_tid,
                        .parent_prio = *prio,
                        .parent_own_prio = own_priority(thread, parent, *prio),
                        .is_parent_boosted = parent != nullptr && parent->inheritance.is_boosted,
                        .parent = thread,
                        .child_first = std::nullopt,
                        .child = std::nullopt};
  if (!free_forks_.empty()) {
    child.fork = free_forks_.back();
    free_forks_.pop_back();
    model_.forks[*child.fork] = facts;
  } else if (model_.forks.size() < 2 * kMaxForks) {
    child.fork = static_cast<std::uint32_t>(model_.forks.size());
    model_.forks.push_back(facts);
  }
  child.is_new = child.fork.has_value();
}

std::optional<std::int32_t> EnforcementTracker::latest_priority(
    const std::optional<ThreadIndex>& thread, const OfTid* seen) const {
  const bool is_switched = seen != nullptr && seen->scheduled;
  if (thread) {
    const auto& read_back = model_.threads[at(*thread)].last_read_back;
    const bool is_latest =
        read_back && (!is_switched || read_back->at.time > seen->scheduled->time);
    if (is_latest) return kernel_priority(*read_back);
  }
  return seen != nullptr ? std::optional(seen->prio) : std::nullopt;
}

std::int32_t EnforcementTracker::own_priority(const std::optional<ThreadIndex>& thread,
                                              const OfTid* seen, std::int32_t latest) const {
  if (thread) {
    const auto& read_back = model_.threads[at(*thread)].last_read_back;
    if (read_back) return kernel_priority(*read_back);
  }
  return seen != nullptr && seen->inheritance.is_boosted ? seen->unboosted : latest;
}

void EnforcementTracker::forget_own(OfTid& tid) {
  tid.inheritance = {};
  tid.own.reset();
  tid.taken_back.reset();
}

void EnforcementTracker::forget_fork(OfTid& child) {
  if (*child.fork < kMaxForks) return;
  model_.forks[*child.fork] = ForkFacts{};
  free_forks_.push_back(*child.fork);
  child.fork.reset();
}

void EnforcementTracker::on_pi_setprio(const EventHead& head, HostIndex host,
                                       const SchedPiSetprio& told) {
  auto event = told;
  auto& tid = tids_[host][event.tid];
  tid.taken_back.reset();
  if (!tid.inheritance.is_boosted) {
    tid.unboosted = event.old_prio;
    const bool is_seen = tid.own && tid.own->prio == event.old_prio;
    if (is_seen && event.new_prio > event.old_prio) tid.taken_back = event.new_prio;
  }
  // Nobody inherits a lower one.
  tid.inheritance = {
      .is_boosted = event.new_prio < tid.unboosted, .prio = event.new_prio, .told = head.time};
  const auto index = registry_.thread_by_tid(host, event.tid);
  if (!index) return;
  auto& thread = model_.threads[at(*index)];
  auto& state = threads_[*index];
  state.may_be_boosted_before = false;
  const auto* expected = reference(thread);
  if (expected == nullptr) return;
  const auto own = kernel_priority(*expected);
  for (auto* prio : {&event.old_prio, &event.new_prio})
    *prio = without_idle_nice(*expected, *prio);
  const bool is_raised = event.new_prio < own;
  state.may_be_boosted = is_raised && event.new_prio == event.old_prio;
  state.inheritance = {
      .is_boosted = is_raised && !state.may_be_boosted, .prio = event.new_prio, .told = head.time};
  if (std::max(event.old_prio, event.new_prio) >= own) thread.perhaps_inherited.reset();
  explain_raised(head, event, *expected, thread, state);
}

// Where nobody waits for it any more the kernel gives it its own priority. Nobody changed that since it
// was seen raised, so the higher one was inherited, though no event told since when.
void EnforcementTracker::explain_raised(const EventHead& head, const SchedPiSetprio& event,
                                        const ReadBack& expected, ThreadFacts& thread,
                                        OfThread& state) {
  const auto own = kernel_priority(expected);
  if (event.old_prio >= own) state.is_still_raised = false;
  auto& raised = thread.raised_priority;
  if (!raised || raised->first.n != expected.n) return;
  const auto& [at, prio] = raised->second;
  const bool is_taken_back =
      event.new_prio == own && prio == event.old_prio && state.is_still_raised;
  if (is_taken_back || (at.time == head.time && prio == event.new_prio)) raised.reset();
}

void EnforcementTracker::on_thread_began(HostIndex host, ThreadIndex index) {
  if (!model_.threads[at(index)].is_known_to_kernel) return;
  auto& tid = tids_[host][model_.threads[at(index)].tid];
  if (tid.thread == index) return;
  auto& state = threads_[index];
  state.busy_before = tid.busy_at_exit;
  state.is_former_unended = tid.thread.has_value() && !tid.has_left;
  tid.thread = index;
  tid.has_left = false;
  if (tid.fork) model_.forks[*tid.fork].child = index;
}

void EnforcementTracker::on_thread_fini(const EventHead& head, ThreadIndex index) {
  places_[index].cpu = Place::kAnywhere;
  const auto host = model_.processes[at(model_.threads[at(index)].process)].host;
  if (!is_totalled_) total_foreign_work(index, host, reading(index, host, head.time));
}

// Nothing was applied to those that still run with what they inherited.
void EnforcementTracker::end_beginnings() {
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& state = threads_[ThreadIndex{static_cast<std::uint32_t>(i)}];
    if (!state.outside_initial.empty()) judge_outside_initial(model_.threads[i], state, false);
  }
}

}  // namespace cie::analysis
