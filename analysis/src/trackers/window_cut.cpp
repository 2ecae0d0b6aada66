#include "window_cut.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

void keep_first(std::optional<std::uint64_t>& first, std::uint64_t number) {
  first = first ? std::min(*first, number) : number;
}

bool is_among(std::uint64_t seq, const SequenceFacts& seqs, const SequenceTracker& starts) {
  return seqs.first && seq >= *seqs.first && seq <= *seqs.last && !starts.is_missing(seq);
}

// Releases are numbered from 1; some writers begin with 0.
std::uint64_t first_number(const std::optional<std::uint64_t>& first_seen) {
  return first_seen == 0U ? 0 : 1;
}

std::uint64_t total_before(const SampleLost& event) {
  return event.total - std::min<std::uint64_t>(event.total, event.count);
}

// The largest number of a release so far.
std::optional<std::uint64_t> last_release(const CallbackFacts& facts,
                                          const std::optional<std::uint64_t>& before) {
  if (!facts.first_release) return before;
  return std::max(facts.last_release, before.value_or(0));
}

}  // namespace

std::uint64_t WindowCut::overwritten_before(const CallbackRelease& release,
                                            const CallbackFacts& facts, const OfCallback& state) {
  const auto last = last_release(facts, state.last_release);
  const bool is_next = release.release_seq <= last.value_or(0) + 1;
  return is_next ? facts.overwritten : release.overwritten;
}

void WindowCut::see_totals(const EventHead& head, const CallbackFini& event,
                           const CallbackFacts& facts, OfCallback& state) const {
  if (is_before(head.time)) {
    state.overwritten.see_before(event.overwritten);
    state.lost.see_before(event.lost);
    return;
  }
  const auto last = last_release(facts, state.last_release);
  const auto first = state.first_release ? state.first_release : facts.first_release;
  const bool is_next = last && event.released == *last + 1 - first_number(first);
  const auto overwritten = is_next ? facts.overwritten : event.overwritten;
  if (is_after(head.time)) {
    state.overwritten.see_after(overwritten);
    state.lost.see_after(event.lost);
  } else {
    state.overwritten.see_inside(overwritten, event.overwritten);
    state.lost.see_inside(event.lost, event.lost);
  }
}

std::uint64_t WindowCut::releases_before(const OfCallback& state) {
  if (!state.last_release) return 0;
  // Each start took a release.
  return std::max(*state.last_release + 1 - first_number(state.first_release),
                  state.next_announced);
}

std::uint64_t WindowCut::releases_until(const OfCallback& state, std::uint64_t seen,
                                        std::uint64_t total) {
  if (!state.next_release) return total;
  const auto next = *state.next_release;
  if (!state.last_release && next == seen) return next;
  return next - std::min(next, first_number(state.first_release));
}

void WindowCut::begin_at(Timestamp time) noexcept {
  is_awaiting_begin_ = false;
  window_.from = std::max(window_.from, time);
  instances_.begin_window(window_.from);
}

void WindowCut::see_inside(const EventHead& head, const Emitter& who, const EventBody& body) {
  if (!who.process) return;
  if (const auto* start = std::get_if<CallbackStart>(&body)) {
    const auto index = index_of(who, start->callback);
    const auto& state = callbacks_[index];
    registry_.note_start_again(start->seq, ref(head), index, state.starts, state.seqs);
    return;
  }
  if (const auto* end = std::get_if<CallbackEnd>(&body)) {
    auto& state = callbacks_[index_of(who, end->callback)];
    if (state.open.erase(end->seq) != 0) {
      ++state.ended_inside;
    } else if (is_among(end->seq, state.seqs, state.starts)) {
      ++state.ended_again_inside;
    }
    return;
  }
  if (const auto* release = std::get_if<CallbackRelease>(&body)) see_inside(who, *release);
  if (const auto* lost = std::get_if<SampleLost>(&body)) see_inside(who, *lost);
}

void WindowCut::see_inside(const Emitter& who, const CallbackRelease& release) {
  const auto index = index_of(who, release.callback);
  auto& state = callbacks_[index];
  const auto before = overwritten_before(release, model_.callbacks[at(index)], state);
  state.overwritten.see_inside(before, release.overwritten);
  if (!is_snapshot_ || state.is_release_known) return;
  state.is_release_known = true;
  if (release.release_seq > 0) {
    state.first_release = 0;
    state.last_release = release.release_seq - 1;
  }
}

void WindowCut::see_inside(const Emitter& who, const SampleLost& lost) {
  callbacks_[index_of(who, lost.callback)].lost.see_inside(total_before(lost), lost.total);
}

void WindowCut::pass_by(const EventHead& head, const Emitter& who, const EventBody& body) {
  if (!who.process) return;
  const bool is_speech =
      std::holds_alternative<CallbackStart>(body) || std::holds_alternative<Publish>(body);
  if (is_speech) registry_.note_reported(head, *who.process);
  if (is_before(head.time)) {
    before(head, who, body);
  } else {
    after(head, who, body);
  }
}

bool WindowCut::is_second_end(CallbackIndex index, std::uint64_t seq) const {
  const auto* before = callbacks_.find(index);
  return (before != nullptr && is_among(seq, before->seqs, before->starts)) ||
         is_among(seq, model_.callbacks[at(index)].starts, registry_.starts(index));
}

void WindowCut::note_start_outside(CallbackFacts& facts, Timestamp time) const noexcept {
  ++facts.starts_outside;
  if (asked_.from <= time && time <= asked_.to) ++facts.starts_left_out;
}

void WindowCut::before(const EventHead& head, const Emitter& who, const EventBody& body) {
  std::visit(
      Overloaded{[&](const CallbackStart& e) {
                   const auto index = index_of(who, e.callback);
                   auto& facts = model_.callbacks[at(index)];
                   facts.first_next_seq = std::max(facts.first_next_seq, e.seq + 1);
                   note_start_outside(facts, head.time);
                   auto& state = callbacks_[index];
                   state.starts.observe(e.seq, ref(head), state.seqs);
                   state.open.insert(e.seq);
                   instances_.begin_outside(head, who, index, e.seq);
                 },
                 [&](const CallbackEnd& e) {
                   instances_.forget_wakes(head, who);
                   const auto index = index_of(who, e.callback);
                   auto& state = callbacks_[index];
                   if (state.open.erase(e.seq) != 0) {
                     instances_.end_outside(head, who, index, e.seq);
                   } else if (is_second_end(index, e.seq)) {
                     ++state.second_ends;
                   }
                 },
                 [&](const CallbackRelease& e) {
                   const auto index = index_of(who, e.callback);
                   auto& state = callbacks_[index];
                   keep_first(state.first_release, e.release_seq);
                   state.last_release = std::max(state.last_release.value_or(0), e.release_seq);
                   state.overwritten.see_before(e.overwritten);
                   auto& overwritten = model_.callbacks[at(index)].overwritten;
                   overwritten = std::max(overwritten, e.overwritten);
                 },
                 [&](const SampleLost& e) {
                   const auto index = index_of(who, e.callback);
                   callbacks_[index].lost.see_before(e.total);
                   auto& lost = model_.callbacks[at(index)].lost;
                   lost = std::max<std::uint64_t>(lost, e.total);
                 },
                 [&](const Publish& e) {
                   const auto index = registry_.publisher(*who.process, e.publisher);
                   auto& next = model_.publishers[index].first_next_seq;
                   next = std::max(next, e.seq + 1);  // threads may tell theirs in another order
                 },
                 [](const auto&) {}},
      body);
}

void WindowCut::after(const EventHead& head, const Emitter& who, const EventBody& body) {
  std::visit(
      Overloaded{[&](const CallbackStart& e) {
                   const auto index = index_of(who, e.callback);
                   keep_first(callbacks_[index].next_start, e.seq);
                   auto& facts = model_.callbacks[at(index)];
                   see_beyond(facts, facts.starts, registry_.starts(index), e.seq, ref(head));
                   note_start_outside(facts, head.time);
                   instances_.pass_start(head, who, index, e.seq);
                 },
                 [&](const CallbackEnd& e) {
                   const auto index = index_of(who, e.callback);
                   auto& state = callbacks_[index];
                   if (state.next_start && e.seq >= *state.next_start) {
                     ++state.ends_after;
                     instances_.pass_end(head, who, index, e.seq);
                   } else if (instances_.is_open(index, e.seq)) {
                     instances_.apply(head, who, e);  // the window's end cuts it
                   } else if (state.open.erase(e.seq) != 0) {
                     ++state.spanning;
                     instances_.pass_end(head, who, index, e.seq);
                   } else if (is_second_end(index, e.seq)) {
                     ++state.second_ends;
                   }
                 },
                 [&](const CallbackRelease& e) {
                   const auto index = index_of(who, e.callback);
                   auto& state = callbacks_[index];
                   keep_first(state.next_release, e.release_seq);
                   state.overwritten.see_after(
                       overwritten_before(e, model_.callbacks[at(index)], state));
                 },
                 [&](const SampleLost& e) {
                   callbacks_[index_of(who, e.callback)].lost.see_after(total_before(e));
                 },
                 [&](const Publish& e) {
                   const auto index = registry_.publisher(*who.process, e.publisher);
                   keep_first(next_publish_[index], e.seq);
                   const auto& facts = model_.publishers[index];
                   see_beyond(facts, facts.published, registry_.published(index), e.seq, ref(head));
                 },
                 [](const auto&) {}},
      body);
}

void WindowCut::see_announced(const EventHead& head, const EventBody& body) {
  if (!is_before(head.time)) return;
  const auto process = registry_.process_of(head);
  if (!process) return;
  const auto note = [](auto& facts, std::uint64_t next) {
    facts.first_next_seq = std::max(facts.first_next_seq, next);
  };
  if (const auto* callback = std::get_if<CallbackInit>(&body)) {
    const auto index = registry_.callback(*process, callback->callback);
    note(model_.callbacks[at(index)], callback->next_seq);
    auto& next = callbacks_[index].next_announced;
    next = std::max(next, callback->next_seq);
  } else if (const auto* publisher = std::get_if<PublisherInit>(&body)) {
    note(model_.publishers[registry_.publisher(*process, publisher->publisher)],
         publisher->next_seq);
  }
}

template <typename Facts>
void WindowCut::see_beyond(const Facts& facts, const SequenceFacts& inside,
                           SequenceTracker& numbers, std::uint64_t number,
                           const EventRef& where) const {
  const bool is_promised = facts.registered && !is_after(facts.registered->time);
  if (inside.last || is_promised) numbers.observe_beyond(number, where, inside);
}

void WindowCut::see_beyond(const EventHead& head, const ThreadSched& event) {
  const auto process = registry_.process_of(head);
  const auto thread = process ? registry_.find_thread(*process, event.tid) : std::nullopt;
  if (!thread) return;
  const auto& facts = model_.threads[at(*thread)];
  if (facts.fini || !facts.read_backs.last) return;
  registry_.read_backs(*thread).observe_beyond(event.n, ref(head), facts.read_backs);
}

bool WindowCut::leaves_out(const EventHead& head, const EventBody& body) {
  if (!is_after(head.time)) return false;
  const auto of = [&](std::int64_t tid) { return tid_of(head, tid); };
  if (const auto* init = std::get_if<ThreadInit>(&body)) {
    const bool is_late = init->start_ns > window_.to.ns;
    if (is_late) late_threads_.emplace(of(init->tid), init->start_ns);
    if (is_late && init->role != ThreadRole::callback) {
      model_.later_threads.emplace(init->name);
    }
    return is_late;
  }
  if (const auto* sched = std::get_if<ThreadSched>(&body)) {
    const auto [first, is_first] = next_read_back_.try_emplace(of(sched->tid), sched->n);
    if (!is_first) first->second = std::min(first->second, sched->n);
    see_beyond(head, *sched);
    return true;
  }
  const auto* fini = std::get_if<ThreadFini>(&body);
  if (fini == nullptr) return false;
  const auto late = late_threads_.lower_bound(LateThread{of(fini->tid), 0});
  return late != late_threads_.end() && late->first == of(fini->tid);
}

std::optional<CallbackFini> WindowCut::cut(const EventHead& head, const CallbackFini& event) {
  const auto process = registry_.process_of(head);
  if (!process) return event;
  const auto index = registry_.callback(*process, event.callback);
  auto& facts = model_.callbacks[at(index)];
  auto& state = callbacks_[index];
  auto totals = event;
  facts.started_in_all = event.started;
  see_totals(head, event, facts, state);
  if (is_before(head.time)) {
    totals.started = facts.first_next_seq;
    totals.ended = facts.first_next_seq;
    totals.released = releases_before(state);
    return totals;
  }
  const auto started = std::min(state.next_start.value_or(event.started), event.started);
  const auto started_after = event.started - started;
  const auto open = instances_.open_count(index);
  // Of second ends the total counts what is more than can have ended: a tracer may have recorded one
  // event twice.
  const auto open_in_all =
      open + state.open.size() + started_after - std::min(started_after, state.ends_after);
  const auto ended_once = event.started - std::min<std::uint64_t>(event.started, open_in_all);
  totals.ended -= std::min(event.ended - std::min(event.ended, ended_once), state.second_ends);
  if (!is_after(head.time)) return totals;
  // What is open at the end of the recording began in the window and never ended.
  const auto ended = started - std::min<std::uint64_t>(started, open);
  const bool is_told = state.ends_after == started_after || open == 0;
  if (!is_told) return std::nullopt;
  totals.started = started;
  totals.ended = state.ends_after == started_after
                     ? totals.ended - std::min(totals.ended, started_after)
                     : ended;
  totals.released = releases_until(state, facts.releases, event.released);
  return totals;
}

PublisherFini WindowCut::cut(const EventHead& head, PublisherFini event) {
  const auto process = registry_.process_of(head);
  if (!process) return event;
  const auto index = registry_.publisher(*process, event.publisher);
  if (is_before(head.time)) event.published = model_.publishers[index].first_next_seq;
  const auto& next = next_publish_[index];
  if (is_after(head.time) && next) event.published = std::min(event.published, *next);
  return event;
}

ThreadFini WindowCut::cut(const EventHead& head, ThreadFini event) {
  const auto next = next_read_back_.find(tid_of(head, event.tid));
  if (next == next_read_back_.end()) return event;
  event.read_backs = std::min(event.read_backs, next->second);
  return event;
}

RunEnd WindowCut::cut(const EventHead& head, RunEnd event) {
  const std::pair process(registry_.host_of(head), head.pid.value_or(-1));
  const auto late = static_cast<std::uint32_t>(
      std::ranges::count(late_threads_, process, [](const LateThread& thread) {
        return std::pair(std::get<0>(thread.first), std::get<1>(thread.first));
      }));
  event.threads -= std::min(event.threads, late);
  return event;
}

bool WindowCut::may_lack(ProcessIndex process, Timestamp until) const {
  const auto host = model_.processes[at(process)].host;
  return std::ranges::any_of(model_.losses, [&](const Loss& loss) {
    return loss.domain == Domain::user && loss.host == host && loss.end >= window_.from &&
           loss.begin <= until;
  });
}

// In a snapshot: what was announced before its window may have run in between, unseen. Where nothing
// is lost within the window, the first number seen in it is the one that was next when it began.
void WindowCut::conclude_callback(CallbackFacts& facts, OfCallback& state) const {
  if (!facts.registered || facts.registered->time >= window_.from) return;
  if (may_lack(facts.process, facts.starts.first ? facts.starts.first_at.time : window_.to)) return;
  auto& next = facts.first_next_seq;
  if (facts.starts.first) {
    next = std::max(next, *facts.starts.first);
  } else if (facts.fini) {
    next = std::max(next, facts.fini->started);
  } else if (facts.ended.last) {
    next = std::max(next, *facts.ended.last + 1);
  }
  if (!facts.fini) return;
  if (!state.is_release_known) {
    state.first_release = 0;
    if (facts.fini->released > 0) state.last_release = facts.fini->released - 1;
  }
}

void WindowCut::conclude_publisher(PublisherFacts& facts) const {
  if (!facts.registered || facts.registered->time >= window_.from) return;
  const bool is_any_seen = facts.published.first.has_value();
  if (may_lack(facts.process, is_any_seen ? facts.published.first_at.time : window_.to)) return;
  if (facts.published.first) {
    facts.first_next_seq = std::max(facts.first_next_seq, *facts.published.first);
  } else if (facts.fini) {
    facts.first_next_seq = std::max(facts.first_next_seq, facts.fini->second);
  }
}

void WindowCut::conclude_queue(CallbackFacts& facts, OfCallback& state) const {
  const bool is_later = facts.registered && is_after(facts.registered->time);
  const bool is_known_inside = facts.registered && facts.registered->time >= window_.from;
  if (is_known_inside && !facts.may_repeat) {
    state.overwritten.begin_with_none();
    state.lost.begin_with_none();
  }
  // In a snapshot of which nothing was lost all that is not told was before.
  const bool is_rest_outside = is_later || (is_snapshot_ && !may_lack(facts.process, window_.to));
  const auto conclude = [&](const RunningTotal& total, std::uint64_t CallbackFacts::*seen,
                            std::uint64_t CallbackTotals::*told) {
    const auto least = total.least_rise();
    const auto most = is_rest_outside ? least : total.most_rise();
    facts.*seen = least;
    if (facts.fini) (*facts.fini).*told = most;
    return least == most;
  };
  const bool is_told =
      conclude(state.overwritten, &CallbackFacts::overwritten, &CallbackTotals::overwritten);
  facts.overwritten_at_first = 0;  // of the window, as the totals from here on
  facts.lost_at_first = 0;
  facts.are_totals_told =
      conclude(state.lost, &CallbackFacts::lost, &CallbackTotals::lost) && is_told;
}

std::uint64_t WindowCut::cut_by_begin(const CallbackFacts& facts, const OfCallback& state) const {
  const auto& last = model_.processes[at(facts.process)].last_seen;
  const bool is_over = last && last->time < window_.from;  // its process ended before
  return state.spanning + state.ended_inside + (is_over ? 0 : state.open.size());
}

void WindowCut::finish() {
  for (auto& publisher : model_.publishers) {
    if (is_snapshot_) conclude_publisher(publisher);
  }
  for (std::size_t i = 0; i < model_.callbacks.size(); ++i) {
    auto& facts = model_.callbacks[i];
    const CallbackIndex index{static_cast<std::uint32_t>(i)};
    auto& state = callbacks_[index];
    if (is_snapshot_) conclude_callback(facts, state);
    conclude_queue(facts, state);
    const auto cut = cut_by_begin(facts, state);
    facts.cut_instances += cut;
    facts.cut_by_begin = cut;
    facts.starts_left_out -= std::min(facts.starts_left_out, cut);
    if (!facts.fini) continue;
    // An instance that began before the window and never ended is no violation in it.
    auto& totals = *facts.fini;
    // More ends than starts that none in it accounts for: the surplus is outside, of lost starts.
    totals.ended =
        std::min(totals.ended, totals.started + facts.second_ends + state.ended_again_inside);
    const auto unended = totals.started - std::min(totals.started, totals.ended);
    const auto inside = std::min<std::uint64_t>(unended, instances_.open_count(index));
    totals.ended += std::min<std::uint64_t>(unended - inside, state.open.size());
    totals.released -= std::min(totals.released, releases_before(state));
  }
}

}  // namespace cie::analysis
