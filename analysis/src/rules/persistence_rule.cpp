#include "persistence_rule.hpp"

#include "callback_doubts.hpp"
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

// Events of two CPUs have no order within a nanosecond.
Evidence unordered_init(const EventRef& init, const ThreadFacts& thread) {
  return evidence("callback_init", init,
                  "in the nanosecond of its instance on " + thread_name(thread) +
                      ": which of the two came first is unknown");
}

// A callback_init came before it ran at all. If that was not seen, which no loss needs to tell, one in
// between may be missing likewise. An announcement repeats what need not have been recorded, and what
// ROS 2 made before its recording it never tells.
std::optional<Evidence> unseen_registration(const RuleContext& context,
                                            const CallbackFacts& callback, const Move& move) {
  if (!callback.is_accounted) return std::nullopt;
  const bool is_seen = callback.registered &&
                       (callback.may_repeat || callback.registered->time <= move.first_on_to.time);
  if (!is_seen) {
    return without_event(
        move.last_on_from,
        "its callback_init was not seen: another one, before it went on on another "
        "thread, may be missing, too");
  }
  // Of the two themselves `run_end` tells whether their announcements are missing.
  const auto& process = context.model.processes[at(callback.process)];
  const bool is_counted = process.run_end && process.first_moment == RunMoment::start;
  for (const auto* pair : callback.ran_on) {
    const auto& thread = thread_of(context.model, pair->thread);
    const bool is_part = pair->thread == move.from || pair->thread == move.to;
    if (thread.announced || (is_part && is_counted)) continue;
    return without_event(move.last_on_from,
                         "it ran on " + thread_name(thread) +
                             ", whose announcement was not seen: a callback_init of it may be "
                             "missing, too");
  }
  return context.proof.unseen_announcement(callback.process);
}

// Why a thread that replaced another one may have been given the callback by a callback_init.
std::vector<Evidence> perhaps_registered(const RuleContext& context, const CallbackFacts& callback,
                                         const Move& move) {
  const auto& to = thread_of(context.model, move.to);
  std::vector<Evidence> reasons;
  const auto add = [&reasons](std::optional<Evidence> reason) {
    if (reason) reasons.push_back(*std::move(reason));
  };
  // A callback_init in between may be what was lost.
  add(context.user_losses.between(to.process, move.last_on_from.time, move.first_on_to.time));
  // So may be that of an announcement before, for which the one in between was taken.
  if (const auto& announced = callback.announced_after;
      announced && announced->second.time > move.last_on_from.time &&
      announced->second.time <= move.first_on_to.time) {
    add(context.user_losses.between(to.process, announced->first, announced->second.time));
  }
  add(unseen_registration(context, callback, move));
  if (callback.last_init && callback.last_init->time == move.first_on_to.time)
    add(unordered_init(*callback.last_init, to));
  return reasons;
}

std::vector<Evidence> witnesses_of(const RuleContext& context, const CallbackFacts& callback,
                                   const Move& move) {
  const auto& from = thread_of(context.model, move.from);
  const auto& to = thread_of(context.model, move.to);
  std::vector<Evidence> witnesses;
  witnesses.push_back(evidence("callback_start", move.last_on_from,
                               "ran on " + thread_name(from) + ", which has ended since"));
  if (from.fini && (is_fini_own(from) || !from.kernel_exit)) {
    witnesses.push_back(evidence("thread_fini", *from.fini, thread_name(from) + " ends"));
  } else if (from.kernel_exit) {
    witnesses.push_back(evidence(std::string(from.kernel_exit_event), *from.kernel_exit,
                                 thread_name(from) + " exits"));
  }
  if (to.announced)
    witnesses.push_back(evidence("thread_init", *to.announced, thread_name(to) + " begins"));
  witnesses.push_back(
      evidence(is_known_by_start(callback, move) ? "callback_start" : "callback_end",
               move.first_on_to, "went on on " + thread_name(to) + " without a new callback_init"));
  return witnesses;
}

// One that is certain is a violation, whatever is missing at others.
void judge_succession(const RuleContext& context, const CallbackFacts& callback, const Move& move,
                      Judgement& judgement) {
  const auto reasons = perhaps_registered(context, callback, move);
  for (const auto& reason : reasons)
    judgement.doubt(reason);
  for (auto& witness : witnesses_of(context, callback, move)) {
    if (reasons.empty()) {
      judgement.fail(std::move(witness));
    } else {
      judgement.doubt(std::move(witness));
    }
  }
}

void judge_move(const RuleContext& context, const CallbackFacts& callback, const Move& move,
                Judgement& judgement) {
  const auto& lives = context.lives;
  const auto& proof = context.proof;
  const auto& from = thread_of(context.model, move.from);
  const auto& to = thread_of(context.model, move.to);
  if (lives.of(move.to).begin < lives.of(move.from).begin) return;
  for (const auto* pair : callback.ran_on) {
    const bool is_part = pair->thread == move.from || pair->thread == move.to;
    if (!is_part || pair->is_certain) continue;
    judgement.doubt(perhaps_anothers(*pair));
    return;
  }
  if (may_be_former(context, to)) {
    judgement.doubt(without_event(move.first_on_to,
                                  "started on " + thread_name(to) + " after its thread_fini"));
    judgement.doubt(proof.incompleteness(to.process));
    return;
  }
  const bool is_from_ended = from.fini && move.last_on_from.time <= from.fini->time;
  if (from.tid == to.tid && !is_from_ended && lives.of(move.to).begin <= move.last_on_from.time) {
    judgement.doubt(
        context.lost_ends.between(move.from, lives.of(move.from).begin, move.last_on_from.time));
    return;
  }
  switch (succession(context, move.from, move.to)) {
    case Succession::together:  // threads that live together are M3's concern
      judgement.doubt(perhaps_replaced(context, move.from, move.last_on_from.time, move.to));
      break;
    case Succession::successive:
      judge_succession(context, callback, move, judgement);
      break;
    case Succession::unknown:
      judgement.doubt([&] {
        return without_event(move.last_on_from, "ran on " + thread_name(from) +
                                                    ", whose exit was not seen, and went on on " +
                                                    thread_name(to));
      });
      break;
  }
}

// A callback_init registers anew, unless it follows a run_begin that announces what there is: that may
// be what was lost.
void judge_registered_move(const RuleContext& context, const RegisteredMove& registered,
                           Judgement& judgement) {
  const auto& [move, init] = registered;
  const auto& lives = context.lives;
  const bool is_later = lives.of(move.to).begin >= lives.of(move.from).begin;
  if (!is_later || succession(context, move.from, move.to) == Succession::together) return;
  const auto process = thread_of(context.model, move.to).process;
  const auto& facts = context.model.processes[at(process)];
  if (init.time == move.last_on_from.time) {
    judgement.doubt(unordered_init(init, thread_of(context.model, move.from)));
  }
  judgement.doubt(context.user_losses.between(process, move.last_on_from.time, init.time));
  if (facts.run_begin || facts.is_from_ros2) return;
  judgement.doubt(
      evidence("callback_init", init,
               "no run_begin: whether this registered it anew or announced it, before it "
               "went on on another thread, is unknown"));
}

// Instances came before the first that was seen, as its number tells. All that told of a thread
// that ran them may be lost, too, where no `run_end` counts threads.
std::optional<Evidence> lost_first_thread(const RuleContext& context,
                                          const CallbackFacts& callback) {
  const auto& process = context.model.processes[at(callback.process)];
  const auto promised = callback.registered ? callback.first_next_seq : 0;
  const bool is_first_seen = callback.starts.first.value_or(0) <= promised;
  if (!callback.is_accounted || process.run_end || is_first_seen) return std::nullopt;
  const auto begin = process.first_moment == RunMoment::start ? process.run_begin->time : kEarliest;
  return context.user_losses.unseen_thread(callback.process, begin, callback.starts.first_at.time);
}

std::vector<SubjectVerdict> judge_persistent(const RuleContext& context) {
  const auto& proof = context.proof;
  const PossibleMoves moves(context);
  auto verdicts = judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (callback.ran_on.empty()) return;
        judgement.check(callback.starts.count);
        const auto& loss = proof.lost_runs(index);
        // Of ROS 2's it may have told of a client, which its thread may have served as well.
        const bool may_hide_client = context.model.processes[at(callback.process)].is_from_ros2;
        if (loss && (may_hide_client || moves.exist_of(callback))) judgement.doubt(loss);
        judgement.doubt(lost_first_thread(context, callback));
        judgement.doubt(context.hidden.on_thread_of(callback));
        judge_moves(context, callback, judgement);
        for (const auto* pair : callback.ran_on) {
          judgement.doubt(context.lost_ends.of(pair->thread));
          if (loss) {
            judgement.doubt(end_after_fini(thread_of(context.model, pair->thread), *pair));
          }
        }
      });
  note_missing_vtid(context.model, verdicts);
  return verdicts;
}

}  // namespace

void judge_moves(const RuleContext& context, const CallbackFacts& callback, Judgement& judgement) {
  for (const auto& move : callback.moves)
    judge_move(context, callback, move, judgement);
  if (!callback.registered_moves) return;
  for (const auto& move : *callback.registered_moves)
    judge_registered_move(context, move, judgement);
}

const Rule kMappingPersistent{
    .id = "M4",
    .name = "mapping-persistent",
    .meaning =
        "A callback stays with its thread: it did not go on on a thread that replaced an earlier "
        "one (or reused its tid) without being registered anew.",
    .why_it_matters = "Parameters belong to threads, and a replaced thread starts without them.",
    .inconclusive_when =
        "the exit of a thread was lost, a new thread_init after a thread_fini, a callback_init in "
        "between or the run_begin by which one only repeats what is known may have been, no "
        "callback_init of the callback was seen before, something else of its process was never "
        "announced (a stream's file may be missing), a crashed process lost events and earlier "
        "instances of the callback, or a thread may have served what ROS 2's events do not show "
        "(M2).",
    .remedy =
        "keep the thread for the life of the callback; where a thread must be replaced, register "
        "the callback again and apply its parameters before it runs.",
    .violation = "moved to another thread",
    .judge = judge_persistent,
    .needs = {.instances = true, .totals = true, .later_state = LaterState::before_evidence}};

}  // namespace cie::analysis
