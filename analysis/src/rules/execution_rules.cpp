#include "execution_rules.hpp"

#include "callback_doubts.hpp"
#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <string>

namespace cie::analysis {
namespace {

void judge_unpaired(const RuleContext& context, const CallbackFacts& callback,
                    Judgement& judgement) {
  if (callback.first_end_without_start) {
    const auto& [seq, where] = *callback.first_end_without_start;
    judgement.doubt(evidence("callback_end", where,
                             "ends seq " + std::to_string(seq) + ", whose start was not seen"));
  }
  if (callback.fini && !context.proof.is_interrupted(callback.process)) return;  // the totals tell
  // One that did not end is none of a crash if the run_end was lost.
  if (has_unended(callback)) {
    judgement.doubt(context.user_losses.since(callback.process, callback.fini->at.time));
  }
  for (const auto& open : callback.open) {
    if (context.lives.is_cut_by_end(open)) continue;
    if (open.is_left) {
      judgement.remark(untold_end(callback, open));
      continue;
    }
    judgement.doubt(
        evidence("callback_start", open.start,
                 "starts seq " + std::to_string(open.seq) + ", whose end was not seen"));
  }
}

// It has one start and one end: which thread ran it the mapping's rules judge.
void remark_elsewhere(const CallbackFacts& callback, Judgement& judgement) {
  const auto& [seq, start, end] = *callback.first_end_elsewhere;
  judgement.remark(evidence("callback_end", end,
                            counted(callback.ends_elsewhere, "instance") +
                                " ended on another thread than started it, first seq " +
                                std::to_string(seq) + ": thread " + std::to_string(*start.tid) +
                                ", then thread " + std::to_string(*end.tid)));
}

std::vector<SubjectVerdict> judge_paired(const RuleContext& context) {
  const auto& proof = context.proof;
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        judgement.checked(callback.starts.count);
        judgement.overrule(proof.lost_runs(index));
        const auto& fini = callback.fini;
        // exit() while it runs: what it counted then is no total.
        const bool is_late = fini && callback.ended.last && *callback.ended.last < fini->started &&
                             callback.ended.last_at.time > fini->at.time;
        if (is_late) {
          judgement.overrule(
              evidence("callback_end", callback.ended.last_at,
                       "ends seq " + std::to_string(*callback.ended.last) + " after the totals"));
        }
        if (fini && fini->started != fini->ended && !proof.is_interrupted(callback.process)) {
          for (const auto& open : callback.open) {
            judgement.fail(evidence("callback_start", open.start,
                                    "seq " + std::to_string(open.seq) + " starts and never ends"));
          }
          judgement.fail(evidence("callback_fini", fini->at,
                                  std::to_string(fini->started) + " started, " +
                                      std::to_string(fini->ended) + " ended, at a clean exit"));
        }
        if (callback.second_ends != 0) {
          if (const auto& second = callback.first_second_end) {
            // Behind a loss it may be another program's of this pid.
            judgement.overrule(context.user_losses.between(callback.process, second->first.time,
                                                           second->second.time));
            const auto seq = "seq " + std::to_string(second->seq);
            judgement.fail(evidence("callback_end", second->first, seq + " ends"));
            judgement.fail(evidence("callback_end", second->second, seq + " ends a second time"));
          } else {
            judgement.fail(evidence(
                "callback_end", callback.ended.last_at,
                counted(callback.second_ends, "end") + " of instances that had ended before"));
          }
        }
        if (fini && callback.ended.last && *callback.ended.last >= fini->started) {
          judgement.fail(evidence("callback_end", callback.ended.last_at,
                                  "ends seq " + std::to_string(*callback.ended.last)));
          judgement.fail(evidence("callback_fini", fini->at,
                                  "but only " + std::to_string(fini->started) + " started"));
        }
        judge_unpaired(context, callback, judgement);
        if (callback.first_end_elsewhere) remark_elsewhere(callback, judgement);
        if (const auto& first = callback.first_exception) {
          judgement.remark(evidence("callback_end", first->second,
                                    counted(callback.exceptions, "instance") +
                                        " ended by an exception, first seq " +
                                        std::to_string(first->first)));
        }
      });
}

void report(const CallbackFacts::Overlap& overlap, Judgement& judgement) {
  const auto first = "seq " + std::to_string(overlap.first_seq);
  judgement.fail(evidence("callback_start", overlap.first_start, first + " starts"));
  judgement.fail(evidence(
      "callback_start", overlap.second_start,
      "seq " + std::to_string(overlap.second_seq) + " starts before " + first + " has ended"));
  if (overlap.first_end) {
    judgement.fail(evidence("callback_end", *overlap.first_end, first + " ends"));
  }
}

std::vector<SubjectVerdict> judge_non_reentrant(const RuleContext& context) {
  const auto& proof = context.proof;
  return judge_callbacks(context, [&](CallbackIndex index, const CallbackFacts& callback,
                                      Judgement& judgement) {
    judgement.checked(callback.starts.count);
    judgement.overrule(proof.loss(index));
    judgement.doubt(context.hidden.on_thread_of(callback));
    if (callback.overlap) {
      report(*callback.overlap, judgement);
    } else if (callback.overlap_unproven) {
      // Without its end the first instance proves nothing, unless the totals say it never ended.
      if (has_unended(callback)) {
        report(*callback.overlap_unproven, judgement);
      } else {
        judgement.doubt(evidence("callback_start", callback.overlap_unproven->first_start,
                                 "whether this instance had ended before the next one started is "
                                 "unknown: its end was not seen"));
      }
    }
  });
}

void report(const Model& model, const ThreadFacts::Nesting& nesting, Judgement& judgement) {
  const auto& outer = model.callbacks[at(nesting.outer)].logical_id;
  judgement.fail(evidence("callback_start", nesting.outer_start, outer + " starts"));
  judgement.fail(evidence("callback_start", nesting.inner_start,
                          model.callbacks[at(nesting.inner)].logical_id + " starts inside it"));
  if (nesting.outer_end) {
    judgement.fail(evidence("callback_end", *nesting.outer_end, outer + " ends"));
  }
}

// Another process may have begun one of the two, or one may be the other, told by both providers.
std::optional<Evidence> perhaps_no_nesting(const RuleContext& context,
                                           const ThreadFacts::Nesting& nesting) {
  for (const auto index : {nesting.inner, nesting.outer}) {
    const auto& callback = context.model.callbacks[at(index)];
    if (auto doubt = perhaps_another_process(callback)) return doubt;
    if (auto doubt = perhaps_told_by_own(context.model, context.proof, context.losses, callback)) return doubt;
  }
  return std::nullopt;
}

std::vector<SubjectVerdict> judge_no_nesting(const RuleContext& context) {
  const auto& model = context.model;
  const auto& losses = context.losses;
  auto verdicts = judge_threads(context, [&](ThreadIndex index, const ThreadFacts& thread,
                                             Judgement& judgement) {
    if (thread.ran.empty() && !is_isolated(thread)) return;
    for (const auto* pair : thread.ran)
      judgement.checked(pair->starts);
    if (const auto lost = losses.on(index)) judgement.overrule(context.proof.loss(*lost));
    if (!thread.ran.empty()) judgement.doubt(context.proof.unseen_callbacks(thread.process));
    judgement.doubt(context.hidden.on(index));
    if (thread.nesting) {
      judgement.overrule(perhaps_no_nesting(context, *thread.nesting));
      report(model, *thread.nesting, judgement);
    } else if (thread.nesting_unproven) {
      const auto& nesting = *thread.nesting_unproven;
      if (nesting.outer_end) {
        judgement.doubt(evidence(
            "callback_end", *nesting.outer_end,
            model.callbacks[at(nesting.outer)].logical_id +
                " ended on another thread: whether it had left this one when " +
                model.callbacks[at(nesting.inner)].logical_id + " started here is unknown"));
      } else if (has_unended(model.callbacks[at(nesting.outer)])) {
        report(model, nesting, judgement);
      } else {
        judgement.doubt(evidence("callback_start", nesting.outer_start,
                                 "whether this instance had ended before the next one started is "
                                 "unknown: its end was not seen"));
      }
    }
  });
  note_missing_vtid(context, verdicts);
  note_runs_lost_whole(context, verdicts);
  return verdicts;
}

}  // namespace

const Rule kStartEndPaired{
    .id = "E1",
    .name = "start-end-paired",
    .meaning =
        "Each instance that starts ends, once. FAIL when a cleanly ended process counts other "
        "numbers of starts and ends, when an instance ends twice, or when more ends than started. "
        "One that an exception ended is complete, and so is one that ended on another thread than "
        "it started on (M2, M3); PASS says how many. Instances that the recording or a crash cuts "
        "are listed in the report, not judged.",
    .why_it_matters =
        "A callback that never ends holds its thread; one that ends twice is not recorded "
        "rightly, and its times mean nothing.",
    .inconclusive_when =
        "a start or end stands alone and no totals tell whether its partner was lost, when an "
        "instance never ended and the run_end, which would tell that from a crash, may be lost, "
        "when an end follows the totals: exit() was called while the callback ran, or when events "
        "were lost between two ends of one instance.",
    .remedy =
        "look for a callback that blocks for ever or leaves by exit() or longjmp(); call each "
        "tracepoint once.",
    .violation = "had starts without ends",
    .judge = judge_paired,
    .needs = {.instances = true, .totals = true}};

const Rule kNonReentrant{
    .id = "E2",
    .name = "non-reentrant",
    .meaning = "No two instances of one callback overlap in time.",
    .why_it_matters =
        "User code is seldom written to run twice at once: what it shares with itself is not "
        "protected.",
    .inconclusive_when =
        "events of the callback were lost between the two, or a thread may have served what ROS "
        "2's events do not show (M2).",
    .remedy = "put the callback into a mutually exclusive group.",
    .violation = "ran twice at once",
    .judge = judge_non_reentrant,
    .needs = {.instances = true, .totals = true}};

const Rule kNoNesting{
    .id = "E3",
    .name = "no-nesting",
    .meaning =
        "No callback starts inside an instance of another on the same thread, as happens when "
        "user code spins an executor inside a callback.",
    .why_it_matters =
        "The inner callback runs at the outer one's priority and its time is counted twice.",
    .inconclusive_when =
        "events of a callback on that thread were lost, another callback may have been lost with "
        "all of its instances, the outer instance ended on another thread and may have left this "
        "one before, the context vtid is absent, or the thread may have served what ROS "
        "2's events do not show (M2).",
    .remedy =
        "do not spin, and do not wait for a future by spinning, inside a callback; use a callback "
        "of the client instead.",
    .violation = "nested callbacks",
    .judge = judge_no_nesting,
    .needs = {.instances = true, .totals = true}};

}  // namespace cie::analysis
