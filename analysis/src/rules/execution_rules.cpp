#include "execution_rules.hpp"

#include <cie/analysis/note.hpp>

#include "callback_doubts.hpp"
#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

void judge_unpaired(const RuleContext& context, const CallbackFacts& callback,
                    Judgement& judgement) {
  if (callback.first_end_without_start) {
    const auto& [seq, where] = *callback.first_end_without_start;
    judgement.unseen(evidence("callback_end", where, note("ends-without-start", {{"seq", seq}})));
  }
  if (callback.fini && !context.proof.is_interrupted(callback.process)) return;  // the totals tell
  // One that did not end is none of a crash if the run_end was lost.
  if (has_unended(callback)) {
    judgement.needs({hidden(EventKind::process_exit, context.known.scope_of(callback.process),
                            callback.fini->at.time)});
  }
  for (const auto& open : callback.open) {
    if (context.lives.is_cut_by_end(open)) continue;
    if (open.is_left) {
      judgement.remark(untold_end(callback, open));
      continue;
    }
    judgement.unseen(
        evidence("callback_start", open.start, note("starts-without-end", {{"seq", open.seq}})));
  }
}

// It has one start and one end: which thread ran it the mapping's rules judge.
void remark_elsewhere(const CallbackFacts& callback, Judgement& judgement) {
  const auto& [seq, start, end] = *callback.first_end_elsewhere;
  judgement.remark(evidence("callback_end", end,
                            note("ended-on-other-threads", {{"instances", callback.ends_elsewhere},
                                                            {"seq", seq},
                                                            {"start_tid", *start.tid},
                                                            {"end_tid", *end.tid}})));
}

// A cleanly ended process counts other numbers of starts and ends.
void claim_unended(const RuleContext& context, CallbackIndex index, const CallbackFacts& callback,
                   Judgement& judgement) {
  const auto& fini = callback.fini;
  if (!fini) return;
  const auto& last = callback.ended.last;
  // exit() while it runs: what it counted then is no total.
  if (last && *last < fini->started && callback.ended.last_at.time > fini->at.time) {
    judgement.unseen(evidence("callback_end", callback.ended.last_at,
                              note("ends-after-totals", {{"seq", *last}})));
    return;
  }
  if (fini->started == fini->ended || context.proof.is_interrupted(callback.process)) return;
  std::vector<Evidence> witnesses;
  for (const auto& open : callback.open) {
    witnesses.push_back(
        evidence("callback_start", open.start, note("starts-and-never-ends", {{"seq", open.seq}})));
  }
  witnesses.push_back(
      evidence("callback_fini", fini->at,
               note("totals-at-clean-exit", {{"started", fini->started}, {"ended", fini->ended}})));
  judgement.violation(std::move(witnesses),
                      {{hidden(EventKind::run_end, context.known.scope_of(index), fini->at.time)}});
}

void claim_second_end(const RuleContext& context, const CallbackFacts& callback,
                      Judgement& judgement) {
  if (callback.second_ends == 0) return;
  const auto& second = callback.first_second_end;
  if (!second) {
    judgement.violation(
        std::vector{evidence("callback_end", callback.ended.last_at,
                             note("ends-of-ended", {{"ends", callback.second_ends}}))});
    return;
  }
  // It may be another program's of this pid.
  judgement.violation(
      std::vector{
          evidence("callback_end", second->first, note("instance-ends", {{"seq", second->seq}})),
          evidence("callback_end", second->second,
                   note("instance-ends-again", {{"seq", second->seq}}))},
      {{context.known.announced_anew(callback.process, second->first.time, second->second.time)}});
}

std::vector<SubjectVerdict> judge_paired(const RuleContext& context) {
  return judge_callbacks(context, [&](CallbackIndex index, const CallbackFacts& callback,
                                      Judgement& judgement) {
    judgement.checked(callback.starts.count);
    judgement.needs(context.known.lost_run(index));
    claim_unended(context, index, callback, judgement);
    claim_second_end(context, callback, judgement);
    const auto& fini = callback.fini;
    if (fini && callback.ended.last && *callback.ended.last >= fini->started) {
      judgement.violation(std::vector{
          evidence("callback_end", callback.ended.last_at,
                   note("ends-instance", {{"seq", *callback.ended.last}})),
          evidence("callback_fini", fini->at, note("only-started", {{"started", fini->started}}))});
    }
    judge_unpaired(context, callback, judgement);
    if (callback.first_end_elsewhere) remark_elsewhere(callback, judgement);
    if (const auto& first = callback.first_exception) {
      judgement.remark(evidence(
          "callback_end", first->second,
          note("ended-by-exception", {{"instances", callback.exceptions}, {"seq", first->first}})));
    }
  });
}

// The instance had ended before the next one started. What ends without a number may be another one, of which the start is
// hidden.
std::vector<Conjunction> ended_before(const RuleContext& context, CallbackIndex callback,
                                      const EventRef& start, Timestamp next,
                                      const std::optional<EventRef>& end) {
  const auto scope = context.known.scope_of(callback);
  Conjunction all{hidden(EventKind::run_end, scope, start.time, next)};
  if (!end) return {all};
  if (context.model.callbacks[at(callback)].is_accounted) return {};
  all.push_back(hidden(EventKind::run_start, scope, next, end->time));
  return {all};
}

void claim_overlap(const RuleContext& context, CallbackIndex index,
                   const CallbackFacts::Overlap& overlap, Judgement& judgement) {
  judgement.violation(
      [&] {
        std::vector witnesses{
            evidence("callback_start", overlap.first_start,
                     note("instance-starts", {{"seq", overlap.first_seq}, {"released", Note{}}})),
            evidence("callback_start", overlap.second_start,
                     note(overlap.first_end ? "starts-before-former-ended"
                                            : "starts-before-former-seen-to-end",
                          {{"seq", overlap.second_seq}, {"former", overlap.first_seq}}))};
        if (overlap.first_end) {
          witnesses.push_back(evidence("callback_end", *overlap.first_end,
                                       note("instance-ends", {{"seq", overlap.first_seq}})));
        }
        return witnesses;
      },
      ended_before(context, index, overlap.first_start, overlap.second_start.time,
                   overlap.first_end));
}

std::vector<SubjectVerdict> judge_non_reentrant(const RuleContext& context) {
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        judgement.checked(callback.starts.count);
        for (const auto* overlap : {&callback.overlap, &callback.overlap_unproven})
          if (*overlap) claim_overlap(context, index, **overlap, judgement);
        judgement.needs(context.known.lost_end(index));
        for (const auto* pair : callback.ran_on)
          judgement.needs(context.known.unseen_run(pair->thread));
      });
}

void claim_nesting(const RuleContext& context, ThreadIndex thread,
                   const ThreadFacts::Nesting& nesting, Judgement& judgement) {
  const auto& model = context.model;
  const NamedCallback outer{model.callbacks[at(nesting.outer)].logical_id};
  const NamedCallback inner{model.callbacks[at(nesting.inner)].logical_id};
  const auto& end = nesting.outer_end;
  if (end && end->tid != nesting.outer_start.tid) {
    judgement.unseen(evidence("callback_end", *end,
                              note("outer-ended-elsewhere", {{"outer", outer}, {"inner", inner}})));
    return;
  }
  auto excuses =
      ended_before(context, nesting.outer, nesting.outer_start, nesting.inner_start.time, end);
  for (const auto* pair : model.threads[at(thread)].ran) {
    if (pair->callback == nesting.outer || pair->callback == nesting.inner)
      excuses.push_back(context.known.another_owner(*pair));
  }
  judgement.violation(
      [&] {
        std::vector witnesses{evidence("callback_start", nesting.outer_start,
                                       note("callback-starts", {{"callback", outer}})),
                              evidence("callback_start", nesting.inner_start,
                                       note("callback-starts-inside", {{"callback", inner}}))};
        if (end) {
          witnesses.push_back(
              evidence("callback_end", *end, note("callback-ends", {{"callback", outer}})));
        }
        return witnesses;
      },
      excuses);
}

std::vector<SubjectVerdict> judge_no_nesting(const RuleContext& context) {
  const auto& known = context.known;
  auto verdicts = judge_threads(
      context, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        if (thread.ran.empty() && !is_isolated(thread)) return;
        for (const auto* pair : thread.ran)
          judgement.checked(pair->starts);
        for (const auto* nesting : {&thread.nesting, &thread.nesting_unproven})
          if (*nesting) claim_nesting(context, index, **nesting, judgement);
        if (const auto lost = context.losses.on(index)) judgement.needs(known.lost_end(*lost));
        need_no_others(context, index, judgement);
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
    .needs = {.instances = true}};

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
    .needs = {.instances = true}};

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
    .needs = {.instances = true}};

}  // namespace cie::analysis
