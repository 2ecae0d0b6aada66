#include "persistence_rule.hpp"

#include <cie/analysis/note.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "possible_moves.hpp"
#include "thread_questions.hpp"
#include "thread_succession.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// Else an end whose start was not seen tells of it.
bool is_known_by_start(const CallbackFacts& callback, const Move& move) {
  const auto pair = std::ranges::find(callback.ran_on, move.to, &CallbackOnThread::thread);
  return pair != callback.ran_on.end() && (*pair)->starts != 0 &&
         (*pair)->first_start.time == move.first_on_to.time && (*pair)->first_seq == move.first_seq;
}

std::vector<Evidence> witnesses_of(const RuleContext& context, const CallbackFacts& callback,
                                   const Move& move) {
  const auto& from = thread_of(context.model, move.from);
  const auto& to = thread_of(context.model, move.to);
  std::vector<Evidence> witnesses;
  witnesses.push_back(evidence("callback_start", move.last_on_from,
                               note("ran-on-ended-thread", {{"thread", thread_name(from)}})));
  if (from.fini && (is_fini_own(from) || !from.kernel_exit)) {
    witnesses.push_back(
        evidence("thread_fini", *from.fini, note("thread-ends", {{"thread", thread_name(from)}})));
  } else if (from.kernel_exit) {
    witnesses.push_back(evidence(std::string(from.kernel_exit_event), *from.kernel_exit,
                                 note("thread-exits", {{"thread", thread_name(from)}})));
  }
  if (to.announced) {
    witnesses.push_back(evidence("thread_init", *to.announced,
                                 note("replacement-begins", {{"thread", thread_name(to)}})));
  }
  witnesses.push_back(
      evidence(is_known_by_start(callback, move) ? "callback_start" : "callback_end",
               move.first_on_to, note("went-on-on-thread", {{"thread", thread_name(to)}})));
  return witnesses;
}

// Up to the nanosecond before it.
Timestamp before(Timestamp time) { return time - Duration{1}; }

// The callback was registered anew in between; or before that, so that what was taken for a registration
// repeats one.
std::vector<Conjunction> registered_between(const CallbackFacts& callback, const Scope& scope,
                                            const Move& move) {
  const auto from = move.last_on_from.time;
  const auto to = move.first_on_to.time;
  std::vector<Conjunction> excuses{{hidden(EventKind::registration, scope, from, to)}};
  if (const auto& repeated = callback.announced_after;
      repeated && repeated->second.time > from && repeated->second.time <= to) {
    excuses.push_back(
        {hidden(EventKind::registration, scope, repeated->first, repeated->second.time)});
  }
  return excuses;
}

void claim_move(const RuleContext& context, const CallbackFacts& callback, const Scope& scope,
                const Move& move, Judgement& judgement) {
  const auto& from = context.lives.of(move.from);
  const auto& to = context.lives.of(move.to);
  const auto left = context.known.scope_of(move.from);
  if (to.begin < from.begin) return;
  switch (succession(context, move.from, move.to)) {
    case Succession::
        together:  // M3's concern; but of ROS 2 the former may have ended unseen, and its tid be another's
      if (is_ros2_only(context.model.processes[at(callback.process)])) {
        judgement.needs(
            {hidden(EventKind::thread_exit, left, move.last_on_from.time, before(to.begin))});
      }
      break;
    case Succession::successive:
      judgement.violation([&] { return witnesses_of(context, callback, move); },
                          registered_between(callback, scope, move));
      break;
    case Succession::unknown:
      judgement.needs({hidden(EventKind::thread_exit, left, from.end, before(to.begin))});
      break;
  }
}

// What was seen as a registration may repeat one: where a run_begin that announces what there is was lost.
// Before it the callback may have run on the other thread already.
void claim_registered_move(const RuleContext& context, const Scope& scope,
                           const RegisteredMove& registered, Judgement& judgement) {
  const auto& [move, init] = registered;
  const auto& lives = context.lives;
  const auto& to = lives.of(move.to);
  if (to.begin < lives.of(move.from).begin ||
      succession(context, move.from, move.to) == Succession::together)
    return;
  const auto left = move.last_on_from.time;
  judgement.needs({hidden(EventKind::registration, scope, init.time, init.time)});
  if (!is_ros2_only(context.model.processes[at(*scope.process)])) {
    judgement.needs({context.known.announced_anew(*scope.process, left, init.time)});
  }
  if (to.begin < init.time) {
    auto run = scope;
    run.thread = move.to;
    judgement.needs(
        {hidden(EventKind::run_start, run, std::max(left, to.begin), before(init.time))});
  }
}

// Instances came before the first that was seen, as its number tells. All that tells of a thread that ran them
// may be hidden with them.
void claim_first_thread(const RuleContext& context, const CallbackFacts& callback,
                        const Scope& scope, Judgement& judgement) {
  const auto& process = context.model.processes[at(callback.process)];
  const auto promised = callback.registered ? callback.first_next_seq : 0;
  if (!callback.is_accounted || callback.starts.first.value_or(0) <= promised) return;
  const auto begin = process.first_moment == RunMoment::start ? process.run_begin->time : kEarliest;
  const auto first = callback.starts.first_at.time;
  const auto of_process = context.known.scope_of(*scope.process);
  judgement.needs({hidden(EventKind::announcement, of_process, begin, first),
                   hidden(EventKind::run_start, scope, begin, first),
                   hidden(EventKind::run_end, scope, begin, first)});
}

// What lost instances may have been: on a thread that nobody knows to be the callback's, or on one that took over
// the tid of one of its own.
void claim_lost_runs(const RuleContext& context, const PossibleMoves& moves,
                     const CallbackFacts& callback, const Scope& scope, Judgement& judgement) {
  const auto of_process = context.known.scope_of(*scope.process);
  const auto run = hidden(EventKind::run_start, scope);
  const bool is_any_lost = context.known.knowledge().gap(run) != nullptr;
  if (is_any_lost && moves.exist_of(callback)) judgement.needs({run});
  const auto& process = context.model.processes[at(callback.process)];
  // One that `run_end` counts and nobody saw may be announced for it.
  if (process.run_end) judgement.needs({run, hidden(EventKind::announcement, of_process)});
  claim_first_thread(context, callback, scope, judgement);
  // A client may be among what was lost, whose responses no event of ROS 2 shows.
  if (process.is_from_ros2) judgement.needs({hidden(EventKind::registration, of_process)});
  for (const auto* pair : callback.ran_on) {
    const auto& thread = thread_of(context.model, pair->thread);
    const auto own = context.known.scope_of(pair->thread);
    judgement.needs(context.known.unseen_run(pair->thread));
    // A tid is presumed not to be given anew where the thread told its end.
    if (process.run_end && !thread.fini && pair->starts > 1) {
      judgement.needs({hidden(EventKind::thread_exit, own, pair->first_start.time,
                              before(pair->last_activity.time))});
    }
    judgement.needs_none(context.known.run_behind_end(*pair));
  }
}

std::vector<SubjectVerdict> judge_persistent(const RuleContext& context) {
  const PossibleMoves moves(context);
  auto verdicts = judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (callback.ran_on.empty()) return;
        judgement.checked(callback.starts.count);
        claim_moves(context, index, judgement);
        claim_lost_runs(context, moves, callback, context.known.scope_of(index), judgement);
      });
  note_missing_vtid(context, verdicts);
  return verdicts;
}

}  // namespace

void claim_moves(const RuleContext& context, CallbackIndex index, Judgement& judgement) {
  const auto& callback = context.model.callbacks[at(index)];
  const auto scope = context.known.scope_of(index);
  for (const auto& move : callback.moves)
    claim_move(context, callback, scope, move, judgement);
  if (callback.registered_moves) {
    for (const auto& move : *callback.registered_moves)
      claim_registered_move(context, scope, move, judgement);
  }
}

const Rule kMappingPersistent{
    .id = "M4",
    .name = "mapping-persistent",
    .meaning =
        "A callback stays with its thread: it did not go on on a thread that replaced an earlier "
        "one (or reused its tid) without being registered anew.",
    .why_it_matters = "Parameters belong to threads, and a replaced thread starts without them.",
    .inconclusive_when =
        "events may be missing where one of these may have been: a callback_init between the two threads (or the "
        "run_begin by which one only repeats what is known), the exit of the former thread, an instance on another "
        "thread; or a thread may have served what ROS 2's events do not show (M2).",
    .remedy =
        "keep the thread for the life of the callback; where a thread must be replaced, register "
        "the callback again and apply its parameters before it runs.",
    .violation = "moved to another thread",
    .judge = judge_persistent,
    .needs = {.instances = true}};

}  // namespace cie::analysis
