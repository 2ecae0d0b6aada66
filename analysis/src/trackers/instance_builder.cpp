#include "instance_builder.hpp"

#include "base/prefetch.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxOpenPerThread = 64;
constexpr std::size_t kMaxMoves = 1024;  // with a callback_init in between, and without
// Threads of a callback from which it may have gone to another one by way of others.
constexpr std::size_t kMaxDetours = 32;
constexpr std::size_t kMaxAnswering = 64;

}  // namespace

bool InstanceBuilder::asks_for_cpus(const SchedulingSpec* spec) {
  return spec != nullptr && std::ranges::any_of(spec->callbacks(), [](const SpecEntry& entry) {
           return entry.parameters.cpus.has_value();
         });
}

void InstanceBuilder::forget_wakes(const EventHead& head, const Emitter& who) {
  forget_wakes(of_thread(who.thread), who, head);
}

bool InstanceBuilder::is_open(CallbackIndex callback, std::uint64_t seq) {
  const auto& open = callbacks_[callback].open;
  return std::ranges::find(open, seq, &PendingInstance::seq) != open.end();
}

void InstanceBuilder::prefetch(const KnownEmitter& runner) const noexcept {
  prefetch_to_write(threads_.find(runner.thread));
  // Up to the first members that few instances touch.
  prefetch_lines(runner.thread_facts, &runner.thread_facts->group);
  if (!runner.ran.is_any()) return;
  const auto callback = runner.ran.index;
  const auto& facts = *runner.ran_facts;
  prefetch_head(&facts);
  prefetch_head(&facts.starts);
  prefetch_head(&facts.ended);
  prefetch_lines(&facts.instances, &facts.releases);
  prefetch_to_write(callbacks_.find(callback));
  measurer_.prefetch(callback);
  chains_.prefetch(callback);
  registry_.prefetch_numbers(callback);
}

void InstanceBuilder::prefetch_start(const KnownEmitter& runner) const noexcept {
  if (!runner.ran.is_any()) return;
  const auto index = runner.ran.index;
  const auto* callback = callbacks_.find(index);
  if (callback == nullptr) return;
  if (callback->last_on != nullptr) prefetch_to_write(callback->last_on);
  chains_.prefetch_start(index);
}

[[gnu::always_inline]] inline std::unique_ptr<PendingInstance> InstanceBuilder::begin(
    const EventHead& head, const Emitter& who, const CallbackStart& event, CallbackIndex index,
    OfThread& on_thread, OfCallback& callback) {
  auto& process = registry_.process_facts_of(who);
  Registry::note_reported(head, process);
  auto pending = ended_.new_instance();
  auto& facts = registry_.facts_of(who, index);
  pending->callback = index;
  pending->callback_facts = &facts;
  pending->process_facts = &process;
  pending->thread = who.thread;
  if (who.thread) pending->thread_facts = &registry_.facts_of(who);
  pending->host = who.host;
  pending->stream = head.stream;
  pending->seq = event.seq;
  pending->start = ref(head);
  const auto release_kind = event.release_kind.value_or(ReleaseKind::none);
  if (release_kind != ReleaseKind::none && event.release_ns >= 0) {
    const Timestamp release{event.release_ns};
    if (release <= head.time) [[likely]] {
      pending->release = release;
    } else {
      note_impossible_release(*pending, release);
    }
  }
  pending->missed = event.missed;
  pending->source_timestamp = event.source_timestamp_realtime_ns;
  pending->writer_gid = event.writer_gid;
  pending->is_writer_undecided = event.is_writer_undecided;
  pending->may_be_another = event.may_be_another;
  pending->realtime_offset = clocks_.synced(who.host);

  if (head.is_derived) facts.is_accounted = false;
  if (event.may_be_another && !facts.own) [[unlikely]]
    facts.keep_own_apart(pending->start);
  // Nothing ran since the last instance that was seen, or this is the first one of all.
  const bool follows = facts.starts.last ? event.seq == *facts.starts.last + 1
                                         : facts.registered && event.seq == facts.first_next_seq;
  registry_.note_start(event.seq, pending->start, index, facts.starts);
  if (facts.first_expiry) follow_grid(*pending);
  if (facts.kind == CallbackKind::timer || release_kind == ReleaseKind::timer) {
    note_missed(*pending);
  }
  if (who.thread) {
    pending->wakeup = on_thread.wakeup;
    if (has_kernel(*pending)) {
      pending->wake = timeline_.last_wake(who.host, *head.tid);
      pending->mark = timeline_.mark(who.host, *head.tid, head.time);
      timeline_.begin_watch(who.host, *head.tid, head.time);
      pending->is_confined = is_confined(*pending);
    }
    if (!on_thread.open.empty()) [[unlikely]]
      forget_doubtful_wakes(head, *pending, on_thread, follows);
    // Of whatever thread: its role may be announced later.
    if (follows && on_thread.open.empty()) {
      pending->alone_since = on_thread.last_activity ? on_thread.last_activity : Timestamp{};
      if (on_thread.nothing_until && *on_thread.nothing_until >= *pending->alone_since) {
        pending->alone_since = *on_thread.nothing_until + Duration{1};
      }
    }
    note_on_thread(*pending, callback);
    if (!on_thread.open.empty()) {
      pending->is_nested = true;
      auto& outer = *on_thread.open.back();
      if (!outer.first_inner) outer.first_inner = {index, pending->start};
      note_left(*pending, on_thread);
      note_lost_ends(index, pending->seq, on_thread, !follows);
    }
  } else {
    ++facts.starts_without_tid;
  }
  for (auto* open : callback.open) {
    if (!open->first_overlapping) open->first_overlapping = {pending->seq, pending->start};
  }

  const auto& window = recording_.window_of(head.stream);
  pending->is_in_window = window.begin && *window.begin <= head.time;
  if (!pending->is_in_window) [[unlikely]] {
    pending->is_in_window =
        facts.is_accounted && recording_.is_recorded_before(head.stream, head.time, process);
  }
  if (pending->is_in_window) pending->read = chains_.add_read(index, head.time);
  if (chains_.may_be_of_chain(pending->writer_gid, pending->source_timestamp,
                              pending->is_writer_undecided))
    chains_.link(*node_of(*pending));
  note_start_on_thread(on_thread, head.time);
  return pending;
}

void InstanceBuilder::apply(const EventHead& head, const Emitter& who, const CallbackStart& event) {
  if (!who.process) return;
  const auto index = registry_.callback(who, event.callback);
  auto& on_thread = of_thread(who.thread);
  auto& callback = callbacks_[index];
  auto pending = begin(head, who, event, index, on_thread, callback);
  measurer_.prefetch(*pending);
  bound_open(on_thread);
  callback.open.push_back(pending.get());
  on_thread.open.push_back(std::move(pending));
}

void InstanceBuilder::apply_with_end(const EventHead& head, const Emitter& who,
                                     const CallbackStart& event, Timestamp end) {
  const auto index = registry_.callback(who, event.callback);
  auto& on_thread = of_thread(who.thread);
  auto& callback = callbacks_[index];
  auto pending = begin(head, who, event, index, on_thread, callback);
  bound_open(on_thread);
  on_thread.last_activity = end;
  on_thread.wakeup = {};  // that of the kernel was not seen
  auto& here = pending->end.emplace(pending->start);
  here.time = end;
  registry_.note_end(pending->seq, here, index, pending->callback_facts->ended);
  if (!on_thread.open.empty()) [[unlikely]]
    note_left(*pending, on_thread);
  close(std::move(pending), callback);
}

// Another one begins.
[[gnu::always_inline]] inline void InstanceBuilder::bound_open(OfThread& thread) {
  if (thread.open.size() < kMaxOpenPerThread) [[likely]]
    return;
  auto oldest = std::move(thread.open.front());
  thread.open.erase(thread.open.begin());
  abandon(std::move(oldest));
}

// Behind the start: it stays unknown, as whoever wrote it read another clock.
void InstanceBuilder::note_impossible_release(const PendingInstance& pending, Timestamp release) {
  auto& told = pending.callback_facts->impossible_releases;
  if (!told) {
    told = CallbackFacts::ImpossibleReleases{
        .count = 0, .seq = pending.seq, .start = pending.start, .release = release};
  }
  ++told->count;
}

void InstanceBuilder::note_missed(const PendingInstance& pending) {
  if (pending.missed == 0) return;
  const auto note = [&pending](std::uint64_t& missed, auto& first) {
    missed += pending.missed;
    if (first) return;
    first = Extreme<std::uint32_t>{.value = pending.missed,
                                   .seq = pending.seq,
                                   .start = pending.start,
                                   .end = std::nullopt,
                                   .release = {}};
  };
  auto& facts = *pending.callback_facts;
  note(facts.missed, facts.first_missed);
  if (facts.own && !pending.may_be_another) note(facts.own->missed, facts.own->first_missed);
}

bool InstanceBuilder::is_confined(const PendingInstance& pending) const {
  const auto& read_back = pending.thread_facts->last_read_back;
  return !recording_.coverage().covers_all(pending.host) && read_back &&
         recording_.coverage().covers(pending.host, read_back->cpus);
}

CallbackOnThread& InstanceBuilder::pair_of(CallbackIndex callback, ThreadIndex thread,
                                           const EventRef& where, std::uint64_t seq) {
  auto& pairs = model_.callbacks[at(callback)].ran_on;
  auto& threads = callbacks_[callback].ran_on;
  const auto place = static_cast<std::size_t>(std::ranges::find(threads, thread) - threads.begin());
  if (place < threads.size()) return *pairs[place];
  const auto* before = callbacks_[callback].last_on;
  if (before != nullptr) note_moves(callback, *before, thread, where, seq);
  auto& pair = model_.pairs.emplace_back(CallbackOnThread{.callback = callback,
                                                          .thread = thread,
                                                          .starts = 0,
                                                          .instances = 0,
                                                          .last_activity = {},
                                                          .first_start = where,
                                                          .first_seq = seq});
  threads.push_back(pair.thread);
  pairs.push_back(&pair);
  model_.threads[at(thread)].ran.push_back(&pair);
  return pair;
}

// From where it ran last, and from where it ran before: that may have ended meanwhile.
void InstanceBuilder::note_moves(CallbackIndex callback, const CallbackOnThread& before,
                                 ThreadIndex to, const EventRef& first_on_to,
                                 std::uint64_t first_seq) {
  auto& facts = model_.callbacks[at(callback)];
  note_move(facts, before, to, first_on_to, first_seq);
  if (facts.ran_on.size() > kMaxDetours) return;
  for (const auto* pair : facts.ran_on) {
    if (pair != &before) note_move(facts, *pair, to, first_on_to, first_seq);
  }
}

// To a thread that never ran it. Where it ran before, it lived together with where it went meanwhile.
void InstanceBuilder::note_move(CallbackFacts& facts, const CallbackOnThread& from, ThreadIndex to,
                                const EventRef& first_on_to, std::uint64_t first_seq) {
  const bool is_registered_again =
      facts.last_init && facts.last_init->time >= from.last_activity.time;
  const Move move{.from = from.thread,
                  .to = to,
                  .last_on_from = from.last_activity,
                  .first_on_to = first_on_to,
                  .first_seq = first_seq};
  if (!is_registered_again) {
    if (facts.moves.size() < kMaxMoves) facts.moves.push_back(move);
    return;
  }
  auto& moves = facts.registered_moves ? *facts.registered_moves : facts.registered_moves.emplace();
  if (moves.size() < kMaxMoves) moves.push_back({.move = move, .registered = *facts.last_init});
}

void InstanceBuilder::note_beside_other(const PendingInstance& pending, CallbackOnThread& pair) {
  const auto& on = *pending.thread_facts;
  const auto& group = pending.callback_facts->group;
  if (pair.first_beside_other || on.fini || (group && on.group == group)) return;
  auto since = on.former.empty() ? on.announced->time : on.former.back().next.time;
  if (const auto own = registry_.find_callback(on.process, *on.callback)) {
    const auto& pairs = model_.callbacks[at(*own)].ran_on;
    const auto here = std::ranges::find(pairs, pair.thread, &CallbackOnThread::thread);
    if (here != pairs.end()) since = std::max(since, (*here)->last_activity.time);
  }
  pair.first_beside_other = {.seq = pending.seq, .start = pending.start, .since = since};
}

inline void InstanceBuilder::note_on_thread(PendingInstance& pending, OfCallback& callback) {
  auto& last = callback.last_on;
  if (last == nullptr || last->thread != *pending.thread) {
    last = &pair_of(pending.callback, *pending.thread, pending.start, pending.seq);
  }
  if (last->starts == 0) {  // an end without its start may have come before
    last->first_start = pending.start;
    last->first_seq = pending.seq;
  }
  pending.pair = last;
  ++last->starts;
  const auto& on = *pending.thread_facts;
  if (on.callback && *on.callback != pending.callback_facts->id) [[unlikely]]
    note_beside_other(pending, *last);
  last->is_certain = last->is_certain || !pending.may_be_another;
  note_activity(*last, pending.start);
}

void InstanceBuilder::apply(const EventHead& head, const Emitter& who, const CallbackEnd& event) {
  if (!who.process) return;
  const auto index = registry_.callback(who, event.callback);
  const auto& thread = who.thread;
  auto& on_thread = of_thread(thread);
  on_thread.last_activity = head.time;
  auto& facts = registry_.facts_of(who, index);
  const auto here = ref(head);
  registry_.note_end(event.seq, here, index, facts.ended);
  auto& open = on_thread.open;
  auto found = open.rbegin();  // most often it is this one
  while (found != open.rend() && !((*found)->callback == index && (*found)->seq == event.seq))
    ++found;
  if (found == open.rend()) {
    if (thread && end_elsewhere(here, *thread, index, event)) {
      forget_wakes(on_thread, who, head);
      return;
    }
    if (thread && !undecided_.empty()) [[unlikely]]
      decide(*thread, nullptr);
    if (thread && !event.may_be_another) {
      note_lost_ends(index, event.seq, on_thread, true);
      note_lost_start(index, on_thread);
    }
    leave_unseen(thread, index, event.seq);
    note_end_without_start(head, index, event.seq);
    if (thread) note_unseen_run(*thread, here, index, event);
    forget_wakes(on_thread, who, head);
    return;
  }
  auto pending = std::move(*found);
  open.erase(std::next(found).base());
  if (!open.empty()) [[unlikely]]
    note_left(*pending, on_thread);
  if (thread && !undecided_.empty()) [[unlikely]]
    decide(*thread, pending.get());
  auto& callback = callbacks_[index];
  callback.open.remove(pending.get());
  pending->end = here;
  pending->status = event.status;
  if (thread && has_kernel(*pending)) {
    const auto mark = timeline_.mark(pending->host, *head.tid, head.time);
    left_[*thread] = mark;
    pending->parts = ThreadTimeline::between(pending->mark, mark);
    pending->preempted_by = timeline_.end_watch(pending->host, *head.tid, head.time);
    pending->is_confined = pending->is_confined && is_confined(*pending);
    if (pending->is_nested) pending->preempted_by.clear();  // the list is the outer one's
    if (!pending->is_nested) {
      if (pending->parts) {
        inside_[*thread].time += pending->parts->execution;
      } else {
        inside_[*thread].is_known = false;
      }
    }
  }
  forget_wakes(on_thread, who, head);
  close(std::move(pending), callback);
}

// Even if its start was not seen.
[[gnu::always_inline]] inline void InstanceBuilder::forget_wakes(OfThread& thread,
                                                                 const Emitter& who,
                                                                 const EventHead& head) {
  if (!who.thread) return;
  if (registry_.facts_of(who).is_known_to_kernel) timeline_.forget_wake(who.host, *head.tid);
  thread.wakeup = {};
}

[[gnu::always_inline]] inline void InstanceBuilder::close(
    std::unique_ptr<PendingInstance>&& pending, OfCallback& callback) {
  if (pending->thread) {
    auto& thread = *pending->thread_facts;
    if (has_ended_after(*pending, pending->first_inner) && !thread.nesting) {
      thread.nesting = nesting_of(*pending);
    }
    callback.last_on = pending->pair;
    note_activity(*pending->pair, *pending->end);
  }
  file(std::move(pending), callback);
}

[[gnu::always_inline]] inline void InstanceBuilder::file(std::unique_ptr<PendingInstance>&& pending,
                                                         OfCallback& callback) {
  auto& facts = *pending->callback_facts;
  if (has_ended_after(*pending, pending->first_overlapping) && !facts.overlap)
    facts.overlap = overlap_of(*pending);
  callback.recent.push(Ended{.seq = pending->seq, .end = *pending->end});
  if (pending->node) pending->node->end = ChainNode::End::settled;
  if (facts.kind == CallbackKind::service && !facts.is_accounted && pending->writer_gid != 0) {
    auto& answering = callback.answering;
    if (answering.size() >= kMaxAnswering) answering.erase(answering.begin());
    answering.push_back(node_of(*pending));
  }
  ended_.add(std::move(pending));
}

// How long it was on either thread nobody knows, so it has no parts.
bool InstanceBuilder::end_elsewhere(const EventRef& here, ThreadIndex thread, CallbackIndex index,
                                    const CallbackEnd& event) {
  auto& callback = callbacks_[index];
  const auto found = std::ranges::find(callback.open, event.seq, &PendingInstance::seq);
  if (found == callback.open.end() || event.may_be_another) return false;
  auto* const begun = *found;
  auto& facts = *begun->callback_facts;
  const bool is_certain = facts.is_accounted && begun->thread && !begun->may_be_another &&
                          !may_be_of_another_program(*begun, thread, here.time);
  if (!is_certain) return false;
  auto& former = threads_[*begun->thread];
  const auto place =
      std::ranges::find(former.open, begun, [](const auto& pending) { return pending.get(); });
  auto pending = std::move(*place);
  former.open.erase(place);
  callback.open.erase(found);
  inside_[*begun->thread].is_known = false;
  inside_[thread].is_known = false;
  pending->end = here;
  pending->status = event.status;
  if (has_kernel(*pending)) timeline_.end_watch(pending->host, *pending->start.tid, here.time);
  decide(*pending->thread, pending.get());
  auto& of_former = *pending->thread_facts;
  if (has_ended_after(*pending, pending->first_inner) && !of_former.nesting_unproven)
    of_former.nesting_unproven = nesting_of(*pending);
  if (facts.ends_elsewhere++ == 0) {
    facts.first_end_elsewhere =
        CallbackFacts::EndElsewhere{.seq = event.seq, .start = pending->start, .end = here};
  }
  auto& pair = pair_of(index, thread, here, event.seq);
  if (pair.first_start.time == here.time && pair.starts == 0)
    pair.first_begun_elsewhere = pending->start;
  pair.is_certain = true;
  note_activity(pair, here);
  callback.last_on = &pair;
  file(std::move(pending), callback);
  return true;
}

const ChainNodeRef& InstanceBuilder::node_of(PendingInstance& pending) {
  if (pending.node) return pending.node;
  pending.node = chains_.new_node(pending.callback);
  auto& node = *pending.node;
  node.callback = pending.callback;
  node.host = pending.host;
  node.seq = pending.seq;
  node.start = pending.start;
  node.read = pending.read;
  node.is_in_window = pending.is_in_window;
  if (!pending.end) {
    node.end =
        pending.callback_facts->is_accounted ? ChainNode::End::awaited : ChainNode::End::untold;
  }
  node.writer_gid = pending.writer_gid;
  node.source_timestamp = pending.source_timestamp;
  if (pending.is_writer_undecided) node.link = ChainNode::Link::unseen;
  node.release = pending.release;
  if (pending.release) {
    node.earliest = pending.release;
  } else if (pending.expiry) {
    node.earliest = pending.expiry;
  } else {  // here, too: the chain may end before this instance does
    pending.written = measurer_.source_time(pending);
    node.earliest = measurer_.bound_of_release(pending);
  }
  return pending.node;
}

std::optional<Duration> InstanceBuilder::inside_execution(ThreadIndex thread, HostIndex host,
                                                          Timestamp now) {
  auto [inside, is_known] = inside_[thread];
  if (!is_known) return std::nullopt;
  const auto& open = threads_[thread].open;
  if (!open.empty()) {
    const auto& outermost = *open.front();
    const auto parts = ThreadTimeline::between(
        outermost.mark, timeline_.mark(host, model_.threads[at(thread)].tid, now));
    if (!parts) return std::nullopt;
    inside += parts->execution;
  }
  return inside;
}

}  // namespace cie::analysis
