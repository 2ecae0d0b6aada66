// What threads ran in all: on a CPU, and outside their callbacks.
#include "enforcement_tracker.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

// Of what a thread did before the recording's first word of it, nothing else is known either.
Timestamp told_since(const ThreadFacts& thread) {
  auto told = thread.first_seen;
  if (thread.announced && (!told || thread.announced->time < told->time)) told = thread.announced;
  const auto born = birth_of(thread).value_or(Timestamp{});
  return told ? std::max(born, told->time) : born;
}

}  // namespace

EnforcementTracker::Beginning EnforcementTracker::beginning_at(Timestamp time) {
  Beginning beginning;
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    const auto& thread = model_.threads[i];
    auto& of_thread = beginning.threads.emplace_back();
    if (!thread.is_known_to_kernel) continue;
    const auto host = model_.processes[at(thread.process)].host;
    timeline_.presume_since(host, thread.tid, time);
    of_thread = {.mark = timeline_.mark(host, thread.tid, time),
                 .is_over = thread.busy_ns.has_value()};
  }
  for (std::size_t i = 0; i < model_.hosts.size(); ++i) {
    const HostIndex host{static_cast<std::uint32_t>(i)};
    const auto* tids = tids_.find(host);
    if (tids == nullptr) continue;
    tids->each_number([&](std::int64_t tid) {
      const auto busy = timeline_.mark(host, tid, time).total.execution;
      beginning.tids.push_back({.host = host, .tid = tid, .busy = busy});
    });
  }
  return beginning;
}

void EnforcementTracker::note_possible_begin(Timestamp time) {
  possible_begins_.insert_or_assign(time, beginning_at(time));
}

void EnforcementTracker::begin_window(Timestamp begin) {
  is_judging_ = true;
  judged_from_ = begin;
  const auto noted = possible_begins_.find(begin);
  const auto beginning =
      noted != possible_begins_.end() ? std::move(noted->second) : beginning_at(begin);
  possible_begins_.clear();
  for (const auto& [host, tid, busy] : beginning.tids)
    tids_[host][tid].busy_before_window = busy;
  for (std::size_t i = 0; i < beginning.threads.size(); ++i) {
    auto& thread = model_.threads[i];
    if (!thread.is_known_to_kernel) continue;
    const auto host = model_.processes[at(thread.process)].host;
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    auto& state = threads_[index];
    const auto& [mark, is_over] = beginning.threads[i];
    const auto before = std::exchange(state.busy_before, mark.total.execution);
    if (thread.busy_ns)
      *thread.busy_ns = is_over ? 0 : *thread.busy_ns - (state.busy_before - before).ns;
    if (!state.first_wait || state.first_wait->time >= begin) continue;
    state.first_wait.reset();
    thread.first_wait.reset();
    if (instances_.is_inside_unseen(index)) continue;  // until that instance has ended
    state.first_wait = mark;
    state.inside_before = instances_.inside_execution(index, host, begin);
    thread.first_wait = begin;
  }
}

void EnforcementTracker::end_window(Timestamp end) {
  is_judging_ = false;
  is_totalled_ = true;
  total(end);
  end_beginnings();
}

bool EnforcementTracker::is_recorded(const ThreadFacts& thread, Timestamp begin,
                                     Timestamp end) const {
  const auto host = model_.processes[at(thread.process)].host;
  if (thread.ran_unrecorded || timeline_.overlaps_hole(host, begin, end)) return false;
  if (!recording_.kernel_record(host, begin).contains(begin, end)) return false;
  const auto& coverage = recording_.coverage();
  if (coverage.covers_all(host)) return true;
  const auto is_confined = [&](const Rare<ReadBack>& read_back) {
    return !read_back || coverage.covers(host, read_back->cpus);
  };
  return thread.last_read_back && is_confined(thread.initial) && is_confined(thread.first_audit) &&
         is_confined(thread.last_read_back) &&
         std::ranges::all_of(thread.applied, [&](const ReadBack& applied) {
           return coverage.covers(host, applied.cpus);
         });
}

void EnforcementTracker::total_foreign_work(ThreadIndex index, HostIndex host, Timestamp end) {
  auto& thread = model_.threads[at(index)];
  const auto& state = threads_[index];
  if (!state.first_wait || !thread.is_known_to_kernel) return;
  if (!model_.hosts[at(host)].has_switches) return;
  const auto parts =
      ThreadTimeline::between(*state.first_wait, timeline_.mark(host, thread.tid, end));
  const auto inside = instances_.inside_execution(index, host, end);
  if (!parts || !inside || !state.inside_before) return;
  if (!is_recorded(thread, state.first_wait->time, end)) return;
  if (thread.kernel_exit) end = std::min(end, thread.kernel_exit->time);
  if (end < state.first_wait->time) return;
  thread.foreign_ns = (parts->execution - (*inside - *state.inside_before)).ns;
  thread.foreign_span_ns = (end - state.first_wait->time).ns;
}

void EnforcementTracker::total(std::optional<Timestamp> end) {
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& thread = model_.threads[i];
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    auto& state = threads_[index];
    thread.cpus_checked += std::exchange(state.allowed_again, 0);
    const auto host = model_.processes[at(thread.process)].host;
    if (!thread.is_known_to_kernel || !model_.hosts[at(host)].has_switches) continue;
    if (!thread.fini && thread.first_seen && !state.is_gone) {
      const auto& last_seen = thread.last_seen ? *thread.last_seen : *thread.first_seen;
      total_foreign_work(index, host, end.value_or(last_seen.time));
    }
    if (registry_.thread_by_tid(host, thread.tid) == index) {
      const auto at_end = end.value_or(Timestamp{});
      const auto total = timeline_.mark(host, thread.tid, at_end).total.execution;
      thread.busy_ns = busy_of(state, tids_[host][thread.tid], total).ns;
    }
    if (state.is_former_unended) thread.busy_ns.reset();
    const auto begin = told_since(thread);
    const auto last = thread.fini ? thread.last_seen.value_or(*thread.fini).time
                                  : end.value_or(thread.last_seen.value_or(EventRef{}).time);
    if (thread.busy_ns && !is_recorded(thread, std::max(begin, judged_from_), last)) {
      thread.busy_ns.reset();
    }
  }
}

void EnforcementTracker::look(Timestamp now) { total(now); }

void EnforcementTracker::finish() {
  if (is_totalled_) return;
  total(model_.end);
  end_beginnings();
}

}  // namespace cie::analysis
