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

// Since then it does nothing. Null: it may.
const EventRef* work_end_of(const ThreadFacts& thread) {
  if (thread.fini) return &*thread.fini;
  return thread.kernel_exit ? &*thread.kernel_exit : nullptr;
}

// The first that told of it. Null: none did.
const StreamFacts* first_stream(const Model& model, const ThreadFacts& thread) {
  const auto& told = thread.first_seen ? thread.first_seen : thread.announced;
  const bool is_any = told && at(told->stream) < model.streams.size();
  return is_any ? &model.streams[at(told->stream)] : nullptr;
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
    if (!thread.scheduled.empty() && registry_.thread_by_tid(host, thread.tid) == index) {
      note_own(thread, tids_[host][thread.tid]);
    }
    const auto& [mark, is_over] = beginning.threads[i];
    const auto before = std::exchange(state.busy_before, mark.total.execution);
    if (thread.busy_ns)
      *thread.busy_ns = is_over ? 0 : *thread.busy_ns - (state.busy_before - before).ns;
    if (!state.foreign || state.foreign->begin >= begin) continue;
    forget_foreign_work(index);
    if (const auto over = work_end_of(thread)) {  // what was totalled then is of before the window
      if (over->time > begin) continue;
      thread.first_wait = begin;
      thread.foreign = ThreadFacts::ForeignWork{.is_whole = true};
      continue;
    }
    if (instances_.is_inside_unseen(index)) continue;  // until that instance has ended
    begin_foreign_work(index,
                       {.mark = mark, .inside = instances_.inside_execution(index, host, begin)});
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

EnforcementTracker::Reading EnforcementTracker::reading(ThreadIndex index, HostIndex host,
                                                        Timestamp time) {
  return {.mark = timeline_.mark(host, model_.threads[at(index)].tid, time),
          .inside = instances_.inside_execution(index, host, time)};
}

void EnforcementTracker::on_record_end(StreamIndex stream, Timestamp time) {
  if (!has_switches_) return;
  registry_.note_last_seen();
  const auto& ended = model_.streams[at(stream)];
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    const auto& thread = model_.threads[i];
    const auto host = model_.processes[at(thread.process)].host;
    const auto* first = first_stream(model_, thread);
    if (host != ended.host || first == nullptr) continue;
    const ThreadIndex index{static_cast<std::uint32_t>(i)};
    auto& state = threads_[index];
    if (first->trace != ended.trace && !is_told_since(thread, state)) continue;
    const bool is_there = registry_.thread_by_tid(host, thread.tid) == index;
    if (is_there) state.record_end = reading(index, host, time);
  }
}

bool EnforcementTracker::is_told_since(const ThreadFacts& thread, const OfThread& state) {
  return state.record_end && thread.last_seen &&
         thread.last_seen->time > state.record_end->mark.time;
}

void EnforcementTracker::begin_foreign_work(ThreadIndex index, const Reading& begin) {
  threads_[index].foreign =
      ForeignWork{.begin = begin.mark.time, .counted_to = begin, .seen = Duration{0}};
  model_.threads[at(index)].first_wait = begin.mark.time;
}

void EnforcementTracker::forget_foreign_work(ThreadIndex index) {
  threads_[index].foreign.reset();
  auto& thread = model_.threads[at(index)];
  thread.first_wait.reset();
  thread.foreign.reset();
}

void EnforcementTracker::count_foreign_work(HostIndex host, ForeignWork& work,
                                            const Reading& until) const {
  const auto& from = work.counted_to;
  const auto parts = ThreadTimeline::between(from.mark, until.mark);
  if (parts && from.inside && until.inside &&
      !timeline_.overlaps_hole(host, from.mark.time, until.mark.time)) {
    work.seen += parts->execution - (*until.inside - *from.inside);
  } else {
    work.is_whole = false;
  }
  work.counted_to = until;
}

void EnforcementTracker::total_foreign_work(ThreadIndex index, HostIndex host,
                                            const Reading& reading) {
  auto& thread = model_.threads[at(index)];
  thread.foreign.reset();
  const auto& state = threads_[index];
  if (!state.foreign || !thread.is_known_to_kernel) return;
  if (!model_.hosts[at(host)].has_switches) return;
  auto end = reading.mark.time;
  if (thread.kernel_exit) end = std::min(end, thread.kernel_exit->time);
  if (end < state.foreign->begin) return;
  auto work = *state.foreign;
  count_foreign_work(host, work, reading);
  thread.foreign = ThreadFacts::ForeignWork{
      .seen = work.seen,
      .span = end - work.begin,
      .is_whole = work.is_whole && is_recorded(thread, work.begin, reading.mark.time)};
}

std::optional<EnforcementTracker::Reading> EnforcementTracker::end_of(
    ThreadIndex index, HostIndex host, bool is_there, std::optional<Timestamp> now) {
  const auto& thread = model_.threads[at(index)];
  const auto& state = threads_[index];
  if (state.record_end && (is_there || !is_told_since(thread, state))) return *state.record_end;
  const auto* first = first_stream(model_, thread);
  if (!is_there || (first != nullptr && first->has_ended)) return std::nullopt;
  if (!now) now = timeline_.last_switch(host);
  if (!now) return std::nullopt;
  if (thread.last_seen && !is_totalled_) now = std::max(*now, thread.last_seen->time);
  return reading(index, host, *now);
}

void EnforcementTracker::total(std::optional<Timestamp> now) {
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& thread = model_.threads[i];
    const ThreadIndex index{static_cast<std::uint32_t>(i)};
    thread.cpus_checked += std::exchange(places_[index].seen_again, 0);
    const auto host = model_.processes[at(thread.process)].host;
    if (thread.is_known_to_kernel && model_.hosts[at(host)].has_switches) total(index, host, now);
  }
}

void EnforcementTracker::total(ThreadIndex index, HostIndex host, std::optional<Timestamp> now) {
  auto& thread = model_.threads[at(index)];
  auto& state = threads_[index];
  const bool is_there = registry_.thread_by_tid(host, thread.tid) == index;
  const auto end = end_of(index, host, is_there, now);
  if (end) {
    if (!thread.fini && thread.first_seen) total_foreign_work(index, host, *end);
    thread.busy_ns = busy_of(state, tids_[host][thread.tid], end->mark.total.execution).ns;
  }
  const bool is_before_window = end && end->mark.time < judged_from_;
  if ((is_there && !end) || is_before_window || state.is_former_unended) thread.busy_ns.reset();
  if (!thread.busy_ns) return;
  auto last = end ? end->mark.time : thread.last_seen.value_or(EventRef{}).time;
  if (thread.fini) {
    last = thread.last_seen.value_or(*thread.fini).time;
  } else if (!end && thread.kernel_exit) {
    last = thread.kernel_exit->time;
  }
  if (!is_recorded(thread, std::max(told_since(thread), judged_from_), last))
    thread.busy_ns.reset();
}

void EnforcementTracker::look() { total(std::nullopt); }

void EnforcementTracker::finish() {
  if (is_totalled_) return;
  total(std::nullopt);
  end_beginnings();
}

}  // namespace cie::analysis
