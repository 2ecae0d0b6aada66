#include "recorded_knowledge.hpp"

#include "callback_doubts.hpp"
#include "early_stream_ends.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/loss_gaps.hpp"
#include "shared_pids.hpp"
#include "thread_losses.hpp"
#include "thread_questions.hpp"
#include "time_namespaces.hpp"
#include "user_losses_of_processes.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

namespace cie::analysis {
namespace {

// A callback of which no event was seen.
constexpr CallbackIndex kUnseenCallback{std::numeric_limits<std::uint32_t>::max()};

Scope unseen_of(Scope scope) {
  scope.callback = kUnseenCallback;
  return scope;
}

template <typename Index, typename Subjects>
void for_each_index(const Subjects& subjects, const auto& visit) {
  for (std::size_t i = 0; i < subjects.size(); ++i)
    visit(Index{static_cast<std::uint32_t>(i)});
}

}  // namespace

RecordedKnowledge::RecordedKnowledge(const Model& model, const ThreadLives& lives,
                                     const KernelHoles& holes, const Proof& proof,
                                     const HiddenCallbacks& unseen, const ThreadLosses& losses)
    : model_(model),
      lives_(lives),
      proof_(proof),
      // Only what a callback's thread emits as it runs is emitted on a CPU that it may use: others announce it, and
      // tell of its end.
      knowledge_(model.gaps, [&model, &proof](const Hidden& hidden, std::int32_t cpu) {
        return hidden.kinds.has_any(kStateKinds) ||
               may_use(model, proof, *hidden.scope.thread, cpu);
      }) {
  if (const auto& missing = proof.missing_user_part()) {
    add({}, kinds_of(Domain::user), {}, GapCause::missing_part,
        without_event(EventRef{}, free_text(*missing)));
  }
  add_shared_pids();
  add_clocks_apart();
  const EarlyStreamEnds early_ends(model);
  for_each_index<ProcessIndex>(model.processes, [&](ProcessIndex index) {
    if (const auto* stream = early_ends.of(model.processes[at(index)])) add_cut(index, *stream);
    expect_state(index);
    expect_callbacks(index);
  });
  for_each_index<CallbackIndex>(model.callbacks,
                                [&](CallbackIndex index) { expect_registration(index); });
  for_each_index<ThreadIndex>(model.threads, [&](ThreadIndex index) {
    add_exits(index, holes);
    expect_announcement(index);
    prove_read_backs(index);
    if (auto unseen_here = unseen.unseen_on(index)) {
      add(scope_of(index), EventKind::unseen_run, {}, GapCause::unseen_entities,
          *std::move(unseen_here));
    }
  });
  for_each_index<CallbackIndex>(model.callbacks, [&](CallbackIndex index) {
    add_reused_identity(index);
    add_unordered_registrations(index);
    prove_runs(index);
    const auto& callback = model.callbacks[at(index)];
    const auto told = perhaps_told_by_own(model, proof, losses, callback);
    if (told) {
      add(scope_of(index), EventKind::other_account, {}, GapCause::reused_identity, *told);
    }
    for (const auto* pair : callback.ran_on)
      add_other_owner(*pair, told);
  });
}

Scope RecordedKnowledge::scope_of(ProcessIndex process) const {
  return {.host = model_.processes[at(process)].host, .process = process};
}

Scope RecordedKnowledge::scope_of(CallbackIndex callback) const {
  auto scope = scope_of(model_.callbacks[at(callback)].process);
  scope.callback = callback;
  return scope;
}

Scope RecordedKnowledge::scope_of(ThreadIndex thread) const {
  auto scope = scope_of(model_.threads[at(thread)].process);
  scope.thread = thread;
  return scope;
}

Scope RecordedKnowledge::scope_of(const CallbackOnThread& pair) const {
  auto scope = scope_of(pair.callback);
  scope.thread = pair.thread;
  return scope;
}

Evidence RecordedKnowledge::evidence_of(const Reason& reason) const {
  const bool is_recorders = reason.cause == GapCause::loss || reason.cause == GapCause::window ||
                            reason.cause == GapCause::stream_edge;
  return is_recorders ? evidence_of_recorder(model_, reason) : reasons_[reason.about];
}

void RecordedKnowledge::add(const Scope& scope, EventKinds kinds, TimeWindow window, GapCause cause,
                            Evidence reason, std::optional<std::uint64_t> at_most) {
  knowledge_.add({.scope = scope,
                  .kinds = kinds,
                  .window = window,
                  .at_most = at_most,
                  .reason = {.cause = cause,
                             .at = reason.time.value_or(kEarliest),
                             .about = static_cast<std::uint32_t>(reasons_.size())}});
  reasons_.push_back(std::move(reason));
}

void RecordedKnowledge::expect(const Hidden& missing, ProcessIndex process, Evidence reason,
                               std::optional<std::uint64_t> count) {
  if (knowledge_.gap(missing) != nullptr) return;
  reason.note = others_missing_too(std::move(reason.note));
  auto others = kStateKinds.without(kReadBackKinds);  // which are numbered
  if (count) {
    others = others.without(missing.kinds);
    add(scope_of(process), missing.kinds, {}, GapCause::unaccounted, reason, count);
  }
  add(scope_of(process), others, {}, GapCause::unaccounted, std::move(reason));
}

// Who is announced is counted by the end of a process. Without that, whoever ran or told of itself was announced.
void RecordedKnowledge::expect_state(ProcessIndex index) {
  const auto& process = model_.processes[at(index)];
  const auto scope = scope_of(index);
  if (is_ros2_only(process)) return;
  if (!process.run_begin) {
    expect(hidden(EventKind::process_begin, scope), index,
           without_event(process.first_seen.value_or(EventRef{}), note("run-begin-unseen")));
  }
  if (auto unseen = proof_.unaccounted_threads(index))
    expect(hidden(EventKind::announcement, scope), index, *std::move(unseen),
           proof_.threads_missing(index));
  else if (proof_.are_all_announced(index))
    knowledge_.discharge(EventKind::announcement, scope, {});
}

// Where two processes are seen to have one pid, the events of all that had it.
void RecordedKnowledge::add_shared_pids() {
  std::map<std::pair<HostIndex, std::int64_t>, const ProcessFacts*> last;
  for (const auto& process : model_.processes)
    if (process.shares_pid_since) last[{process.host, process.told_pid}] = &process;
  for_each_index<ProcessIndex>(model_.processes, [&](ProcessIndex index) {
    const auto& process = model_.processes[at(index)];
    const auto found = last.find({process.host, process.told_pid});
    if (found == last.end()) return;
    add(scope_of(index), EventKind::other_process, {}, GapCause::reused_identity,
        shared_pid(*found->second));
  });
}

void RecordedKnowledge::add_clocks_apart() {
  for (auto& [host, why] : clocks_apart(model_))
    add({.host = host}, EventKind::clock_shift, {}, GapCause::clock, std::move(why));
}

// What the process emitted behind the end of a stream that was cut.
void RecordedKnowledge::add_cut(ProcessIndex index, const StreamFacts& stream) {
  add(scope_of(index), kinds_of(Domain::user), {.from = *stream.end, .to = kLatest},
      GapCause::recorder_failed,
      evidence("stream_end", moment(*stream.end),
               note("stream-ends-early", {{"stream", NamedFile{stream.path}}})));
}

// All events of a callback that no event names. They have no numbers; `run_end` counts it.
void RecordedKnowledge::expect_callbacks(ProcessIndex index) {
  const auto scope = unseen_of(scope_of(index));
  if (proof_.are_all_callbacks_seen(index)) {
    knowledge_.discharge(EventKind::registration, scope, {});
  } else if (auto unseen = proof_.counted_callbacks_unseen(index)) {
    add(scope, kStateKinds | kRunKinds, {}, GapCause::unaccounted, *std::move(unseen));
  }
}

// Before it ran at all. What ROS 2 made before its recording it never tells.
void RecordedKnowledge::expect_registration(CallbackIndex index) {
  const auto& callback = model_.callbacks[at(index)];
  if (!callback.is_accounted) return;
  auto first = callback.starts.first ? callback.starts.first_at.time : kLatest;
  for (const auto* pair : callback.ran_on)
    first = std::min(first, pair->first_start.time);
  const bool is_seen =
      callback.registered && (callback.may_repeat || callback.registered->time <= first);
  if (is_seen) return;
  expect(hidden(EventKind::registration, scope_of(index), kEarliest, first), callback.process,
         without_event(callback.ran_on.empty() ? first_sign(model_, callback)
                                               : callback.ran_on.front()->first_start,
                       note("callback-init-unseen")));
}

// The kernel may have switched it in behind its own last event, if that was no other thread of its tid.
Timestamp RecordedKnowledge::last_sign_of(ThreadIndex index) const {
  const auto last = lives_.of(index).end;
  const auto& run = model_.threads[at(index)].switched_in;
  const bool is_its_own =
      run && run->time > last && !lives_.may_be_another(index, run->time) &&
      knowledge_.gap(hidden(EventKind::thread_exit, scope_of(index), last, run->time)) == nullptr;
  return is_its_own ? run->time : last;
}

// Of a thread that ran callbacks and was not seen to be announced it is missing, unless totals prove that it never was.
void RecordedKnowledge::expect_announcement(ThreadIndex index) {
  const auto& thread = model_.threads[at(index)];
  if (thread.announced && proof_.are_all_accounted(thread.process))
    knowledge_.discharge(EventKind::announcement, scope_of(index), {});
  if (thread.announced || thread.ran.empty()) return;
  auto missing = proof_.loss(index);
  if (!missing) missing = proof_.incompleteness(thread.process);
  if (missing)
    add(scope_of(index), EventKind::announcement, {}, GapCause::unaccounted, *std::move(missing));
}

void RecordedKnowledge::add_exits(ThreadIndex index, const KernelHoles& holes) {
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  const auto& life = lives_.of(index);
  if (is_ros2_only(process) &&
      thread.tid != process.pid) {  // the main thread lives as long as its process
    // Proof: who ran before and after lived in between.
    for (const auto* pair : thread.ran) {
      if (!pair->is_certain || !is_of_its_own(model_.callbacks[at(pair->callback)])) continue;
      knowledge_.discharge(
          EventKind::thread_exit, scope_of(index),
          {.from = pair->first_start.time, .to = pair->last_activity.time - Duration{1}});
    }
    // The kernel would tell it.
    const bool is_told = model_.hosts[at(process.host)].has_switches &&
                         !holes.since(process.host, life.begin, life.end);
    if (!is_told) {
      add(scope_of(index), EventKind::thread_exit, {}, GapCause::not_recorded,
          without_event(moment(life.end, thread.tid),
                        note("ros2-has-no-thread-exits", {{"tid", thread.tid}})));
    }
  }
  // Where a process ended in order each of its threads told its end.
  const bool must_tell = process.run_end && !thread.fini &&
                         (thread.announced || !proof_.are_all_announced(thread.process));
  if (must_tell) {
    add(scope_of(index), EventKind::thread_exit, {}, GapCause::unaccounted,
        evidence("run_end", process.run_end->at,
                 note("thread-end-unseen", {{"thread", thread_name(thread)}})));
  } else if (!life.has_ended() || life.latest_end() > life.end) {
    const auto last = last_sign_of(index);
    add(scope_of(index), EventKind::thread_exit,
        {.from = last, .to = life.ended_by.value_or(kLatest)}, GapCause::not_recorded,
        without_event(moment(last, thread.tid),
                      note("thread-exit-unseen", {{"thread", thread_name(thread)}})));
  }
}

// What its address told of since may be of another callback.
void RecordedKnowledge::add_reused_identity(CallbackIndex index) {
  const auto& callback = model_.callbacks[at(index)];
  for (const auto* pair : callback.ran_on) {
    auto doubt = perhaps_anothers(*pair);
    if (!doubt) continue;
    add(scope_of(index), EventKind::registration,
        {.from = callback.own ? callback.own->others_since.time : pair->first_start.time,
         .to = kLatest},
        GapCause::reused_identity, *std::move(doubt));
    return;
  }
}

// Whose instances on a thread a callback's are: of ROS 2's, which are known by an address, those of another callback, of
// another process of that pid, or of one that the process's own events have by another id.
void RecordedKnowledge::add_other_owner(const CallbackOnThread& pair,
                                        const std::optional<Evidence>& told_by_own) {
  const auto& callback = model_.callbacks[at(pair.callback)];
  auto doubt = perhaps_anothers(pair);
  if (!doubt) doubt = perhaps_another_process(callback);
  if (!doubt) doubt = told_by_own;
  if (!doubt && !pair.is_of_several && !is_of_its_own(callback)) {
    doubt = without_event(
        first_sign(model_, callback),
        note("registration-unseen-address", {{"callback", NamedCallback{callback.logical_id}}}));
  }
  if (doubt)
    add(scope_of(pair), EventKind::reuse, {}, GapCause::reused_identity, *std::move(doubt));
}

// Events of two CPUs have no order within a nanosecond.
void RecordedKnowledge::add_unordered_registrations(CallbackIndex index) {
  const auto& callback = model_.callbacks[at(index)];
  const auto add_at = [&](const EventRef& init, const Move& move) {
    const bool is_first = init.time == move.last_on_from.time;
    if (!is_first && init.time != move.first_on_to.time) return;
    const auto& thread = model_.threads[at(is_first ? move.from : move.to)];
    add(scope_of(index), EventKind::registration, {.from = init.time, .to = init.time},
        GapCause::clock,
        evidence("callback_init", init,
                 note("unordered-registration", {{"thread", thread_name(thread)}})));
  };
  for (const auto& move : callback.moves)
    if (callback.last_init) add_at(*callback.last_init, move);
  if (!callback.registered_moves) return;
  for (const auto& [move, init] : *callback.registered_moves)
    add_at(init, move);
}

std::vector<Conjunction> RecordedKnowledge::read_backs(ThreadIndex thread, Timestamp from,
                                                       Timestamp to) const {
  const auto read = hidden(kReadBackKinds, scope_of(thread), from, to);
  auto of_another_spin = read;
  of_another_spin.is_unnumbered = true;
  return {{read}, {hidden(EventKind::announcement, scope_of(thread), from, to), of_another_spin}};
}

std::vector<Conjunction> RecordedKnowledge::replaced(ThreadIndex index, Timestamp last,
                                                     Timestamp next) const {
  if (next <= last) return {};
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  const auto exit = hidden(EventKind::thread_exit, scope_of(index), last, next - Duration{1});
  // ROS 2 announces no threads; and the kernel, or who was announced, may show that the tid was given anew.
  const bool is_shown = !thread.fini && lives_.is_tid_given_anew(index, last, next);
  if (is_ros2_only(process) || is_shown) return {{exit}};
  return {{exit, hidden(EventKind::announcement, scope_of(index), last, next)}};
}

std::optional<Evidence> RecordedKnowledge::why_hidden(
    std::span<const Conjunction> conjunctions) const {
  const auto* gap = knowledge_.any_gap(conjunctions);
  return gap != nullptr ? std::optional(evidence_of(gap->reason)) : std::nullopt;
}

// A subject of no process, or of several, may be any process's.
std::vector<Conjunction> RecordedKnowledge::misattributed(const Subject& about,
                                                          bool is_order_needed) const {
  const auto scope = about.process ? scope_of(*about.process) : Scope{};
  std::vector<Conjunction> all{{hidden(EventKind::other_process, scope)}};
  if (is_order_needed) all.push_back({hidden(EventKind::clock_shift, scope)});
  return all;
}

Conjunction RecordedKnowledge::other_account(CallbackIndex callback) const {
  return {hidden(EventKind::other_account, scope_of(callback))};
}

Hidden RecordedKnowledge::announced_anew(ProcessIndex process, Timestamp from, Timestamp to) const {
  return hidden(EventKind::process_begin, scope_of(process), from, to);
}

// What its process has was announced, or made, since the first event that was seen of it.
Conjunction RecordedKnowledge::unseen_callback_of(ProcessIndex process, const Scope& scope) const {
  const auto& first = model_.processes[at(process)].first_seen;
  const auto since = first ? first->time : kEarliest;
  return {hidden(EventKind::registration, unseen_of(scope), since),
          hidden(EventKind::run_start, unseen_of(scope), since)};
}

Conjunction RecordedKnowledge::unseen_callback(ProcessIndex process) const {
  return unseen_callback_of(process, scope_of(process));
}

Conjunction RecordedKnowledge::unseen_registration(ProcessIndex process) const {
  return {unseen_callback(process).front()};
}

Conjunction RecordedKnowledge::unseen_callback(ThreadIndex thread) const {
  return unseen_callback_of(model_.threads[at(thread)].process, scope_of(thread));
}

Conjunction RecordedKnowledge::unseen_run(ThreadIndex thread) const {
  return {hidden(EventKind::unseen_run, scope_of(thread))};
}

Conjunction RecordedKnowledge::lost_run(CallbackIndex callback) const {
  return {hidden(EventKind::run_start, scope_of(callback))};
}

Conjunction RecordedKnowledge::lost_end(CallbackIndex callback) const {
  return {hidden(EventKind::run_end, scope_of(callback))};
}

std::vector<Conjunction> RecordedKnowledge::other_instances(CallbackIndex callback, Timestamp from,
                                                            Timestamp to) const {
  if (model_.callbacks[at(callback)].is_accounted) return {};
  return {{hidden(EventKind::run_end, scope_of(callback), from, to),
           hidden(EventKind::run_start, scope_of(callback), from, to)}};
}

std::vector<Conjunction> RecordedKnowledge::run_behind_end(const CallbackOnThread& pair) const {
  const auto& fini = model_.threads[at(pair.thread)].fini;
  const auto last = pair.last_activity.time;
  if (!fini || last <= fini->time) return {};
  return {{hidden(EventKind::run_start, scope_of(pair), fini->time, last)}};
}

Conjunction RecordedKnowledge::another_owner(const CallbackOnThread& pair) const {
  return {hidden(EventKind::reuse, scope_of(pair))};
}

std::vector<Conjunction> RecordedKnowledge::other_parameters(ThreadIndex thread,
                                                             const ReadBack& applied,
                                                             Timestamp until) const {
  const bool is_first_audit = model_.threads[at(thread)].applied.empty();
  return read_backs(thread, is_first_audit ? kEarliest : applied.at.time, until);
}

// Numbers go on from one read-back to the next, and `thread_fini` has their total.
void RecordedKnowledge::prove_read_backs(ThreadIndex index) {
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  const auto& numbers = thread.read_backs;
  const auto scope = scope_of(index);
  const auto prove = [&](Timestamp from, Timestamp to) {
    knowledge_.discharge(kReadBackKinds, scope, {.from = from, .to = to});
  };
  const auto& lost = proof_.lost_read_backs(index);
  if (thread.spins > 1) {  // numbers of several spins prove nothing but together
    if (!lost) prove(kEarliest, kLatest);
  } else if (numbers.count != 0) {
    const auto first = numbers.first_at.time;
    const auto last = numbers.last_at.time;
    if (*numbers.first == 0) {
      prove(kEarliest, first);
      // All that the process has was announced here first, and audited behind that.
    } else if (process.first_moment == RunMoment::announce && thread.announced &&
               thread.announcements_at_init <= 1 && process.first_seen &&
               process.first_seen->time >= process.run_begin->time) {
      prove(kEarliest, thread.announced->time);
    }
    const auto& gap = numbers.first_gap;
    prove(first, gap ? gap->before.time : last);
    if (gap && numbers.missing == gap->seen - gap->expected) prove(gap->after.time, last);
    const auto known = *numbers.first + numbers.count + numbers.missing;
    // Behind a window another read-back may tell of a gap that begins within it.
    const auto next = gap ? std::max(gap->after.time, last) : last;
    if (thread.fini && thread.fini_read_backs <= known) prove(next, kLatest);
  } else if (thread.fini && thread.fini_read_backs == 0) {
    prove(kEarliest, kLatest);
  }
  if (lost && knowledge_.gap(hidden(kReadBackKinds, scope)) == nullptr)
    add(scope, kReadBackKinds, {}, GapCause::unaccounted, *lost);
}

// Numbers and totals tell which instances were lost, and between which others. Those of ROS 2 have neither.
void RecordedKnowledge::prove_runs(CallbackIndex index) {
  const bool is_numbered = model_.callbacks[at(index)].is_accounted;
  const auto scope = scope_of(index);
  if (const auto& left = proof_.unseen_end(index)) {  // an exception ended it
    add(scope, EventKind::run_end, {.from = left->time.value_or(kEarliest), .to = kLatest},
        GapCause::not_recorded, *left);
  } else if (is_numbered && !proof_.loss(index)) {
    knowledge_.discharge(EventKind::run_end, scope, {});
  }
  const auto& lost = proof_.lost_runs(index);
  if (!lost) {
    if (is_numbered) knowledge_.discharge(EventKind::run_start, scope, {});
    return;
  }
  if (knowledge_.gap(hidden(EventKind::run_start, scope)) != nullptr) return;
  add(scope, kRunKinds, {}, GapCause::unaccounted, *lost);
}

}  // namespace cie::analysis
