#include "response_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "each_subject.hpp"
#include "instance_evidence.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "outlived_instances.hpp"
#include "spec_questions.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// An instance that seems too long was not: it is several. Or it ended twice, as where more ended than started; if an
// end was lost that may have been the first one.
std::vector<Conjunction> ended_before(const RuleContext& context, CallbackIndex index,
                                      const Extreme<Duration>& longest) {
  const auto& callback = context.model.callbacks[at(index)];
  const auto& fini = callback.fini;
  auto excuses = context.known.other_instances(index, longest.start.time,
                                               longest.end.value_or(longest.start).time);
  const bool is_any_end_lost = fini && callback.ended.count < fini->ended;
  if (is_any_end_lost && fini->ended > fini->started)
    excuses.push_back(context.known.lost_end(index));
  return excuses;
}

// An instance that never ended, as the totals prove, and ran beyond its deadline all the same.
void judge_never_ended(const RuleContext& context, CallbackIndex index, std::int64_t deadline,
                       Judgement& judgement) {
  const auto& callback = context.model.callbacks[at(index)];
  const auto& fini = callback.fini;
  if (!has_unended(callback)) return;
  for_each_open(callback, [&](const OpenInstance& open) {
    const auto window_end = end_of_window(context.model, open.start.stream);
    // While it is still recorded, and of what came after an interruption, no more is known than that
    // its totals were told.
    const bool is_told_last = !window_end || (context.proof.is_interrupted(callback.process) &&
                                              fini->at.time < *window_end);
    const auto until = is_told_last ? fini->at.time : *window_end;
    const auto since = latest_release(open);
    judgement.checked();
    if ((until - since).ns <= deadline) {
      judgement.unseen(evidence("callback_start", open.start,
                                note("deadline-beyond-window", {{"seq", open.seq}})));
      return;
    }
    auto later = note(is_told_last ? "totals-told-later" : "window-ends-later",
                      {{"later", until - since}, {"deadline", Duration{deadline}}});
    judgement.violation(
        std::vector{
            evidence("callback_start", open.start,
                     note("released-never-ends", {{"seq", open.seq}, {"release", since.ns}})),
            is_told_last ? evidence("callback_fini", fini->at, std::move(later))
                         : evidence("window", moment(until), std::move(later))},
        {{hidden(EventKind::run_end, context.known.scope_of(index), open.start.time, until)}});
  });
  const auto unended = fini->started - fini->ended;
  if (callback.open.size() + callback.running.size() < unended) {
    judgement.unseen(evidence("callback_fini", fini->at,
                              note("releases-of-unended-unknown", {{"instances", unended}})));
  }
}

// An instance that was still open when its process, which left no totals, told of itself last. What a
// crash cut before its deadline is not judged.
void judge_outlived(const RuleContext& context, CallbackIndex index, const OpenInstance& open,
                    std::int64_t deadline, Judgement& judgement) {
  const auto& callback = context.model.callbacks[at(index)];
  const auto since = latest_release(open);
  const auto outlived = analysis::outlived(context, callback, open);
  if (!outlived || (outlived->last.time - since).ns <= deadline) return;
  const auto& window = context.options.window;
  if (window && (window->to - since).ns <= deadline) return;  // asked for up to there
  judgement.checked();
  if (outlived->doubt) {
    judgement.unseen(outlived->doubt);
    return;
  }
  if ((outlived->until - since).ns <= deadline) {
    judgement.unseen(evidence("window", moment(outlived->until),
                              note("stream-ends-before-deadline", {{"seq", open.seq}})));
    return;
  }
  auto still = note("still-open", {{"seq", open.seq},
                                   {"later", outlived->until - since},
                                   {"sign", outlived->sign},
                                   {"deadline", Duration{deadline}}});
  judgement.violation(
      std::vector{
          evidence("callback_start", open.start,
                   note("released-without-end", {{"seq", open.seq}, {"release", since.ns}})),
          outlived->until == outlived->last.time
              ? without_event(outlived->last, std::move(still))
              : evidence("window", moment(outlived->until), std::move(still))},
      {{hidden(EventKind::run_end, context.known.scope_of(index), open.start.time,
               outlived->until)}});
}

struct Deadline {
  std::int64_t ns;
  std::string origin;  // "spec.yaml:3"
};

Note missed(const Deadline& deadline, Duration response, std::optional<Note> error = {}) {
  return note("deadline-missed", {{"response", response},
                                  {"error", std::move(error)},
                                  {"spec", deadline.origin},
                                  {"deadline", Duration{deadline.ns}}});
}

Note missed_at_least(const Deadline& deadline, Duration response) {
  return note(
      "deadline-missed-at-least",
      {{"response", response}, {"spec", deadline.origin}, {"deadline", Duration{deadline.ns}}});
}

// "at least" where no release is known exactly.
Note missed_for_certain(const CallbackFacts& callback, const Deadline& deadline,
                        const std::optional<Extreme<Duration>>& known,
                        const Extreme<Duration>& certain) {
  const bool is_exact = known && !callback.has_grid_releases() && known->seq == certain.seq &&
                        known->value == certain.value;
  return is_exact ? missed(deadline, certain.value) : missed_at_least(deadline, certain.value);
}

struct Late {
  const Extreme<Duration>& instance;
  Note finding;
};

// `longest`: of the callback, or of what is its own for certain. Empty: none is beyond the deadline
// for certain. Of those with a calculated release, what is certain first.
std::optional<Late> find_late(const CallbackFacts& callback, const auto& longest,
                              const Deadline& deadline) {
  const auto& [known, lower] = std::tie(longest.max_response, longest.max_response_lower);
  if (lower && lower->value.ns > deadline.ns)
    return Late{*lower, missed_for_certain(callback, deadline, known, *lower)};
  const bool is_calculated = callback.has_grid_releases() && callback.are_releases_certain();
  if (is_calculated && known && (known->value - callback.release_error()).ns > deadline.ns)
    return Late{*known, missed(deadline, known->value, error_of(callback))};
  return std::nullopt;
}

void judge_late(const RuleContext& context, CallbackIndex index, const Deadline& deadline,
                Judgement& judgement) {
  const auto& callback = context.model.callbacks[at(index)];
  const auto late = find_late(callback, callback, deadline);
  const auto& own = callback.own;
  const auto certain = own ? find_late(callback, *own, deadline) : late;
  if (certain) {
    judgement.violation(shown_by(certain->instance, certain->finding),
                        ended_before(context, index, certain->instance));
  } else if (late) {
    doubt_others(callback, late->finding, judgement);
  }
}

// An instance that stands in the trace where other streams do not.
void judge_outside(const Extreme<Duration>& longest, std::int64_t allowed, Note what,
                   const std::vector<Conjunction>& excuses, Judgement& judgement) {
  if (longest.value.ns <= allowed || judgement.has_witness()) return;
  judgement.violation(shown_by(longest, not_counted(std::move(what))), excuses);
}

std::optional<Evidence> bounds_by_a_set_clock(const CallbackFacts& callback) {
  if (callback.with_doubtful_bound == 0) return std::nullopt;
  return without_event(callback.starts.last_at,
                       note("clock-set-meanwhile", {{"instances", callback.with_doubtful_bound}}));
}

bool asks_for_deadline(const SpecEntry& entry) { return entry.response_deadline_ns.has_value(); }

bool asks_for_budget(const SpecEntry& entry) { return entry.wcet_ns.has_value(); }

std::vector<SubjectVerdict> judge_deadline(const RuleContext& context) {
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (auto unknown = unknown_entry(context, callback, asks_for_deadline)) {
          judgement.unseen(*std::move(unknown));
          return;
        }
        if (!callback.response_deadline) return;
        const auto deadline = callback.response_deadline->ns;
        const auto* entry = spec_entry(context, callback);
        const bool is_specified = entry != nullptr && entry->response_deadline_ns;
        const Deadline with_origin{
            .ns = deadline, .origin = is_specified ? place(context, entry->line) : "callback_init"};
        judgement.checked(callback.instances);
        judgement.needs(context.known.lost_end(index));
        judge_never_ended(context, index, deadline, judgement);
        for_each_open(callback, [&](const OpenInstance& open) {
          judge_outlived(context, index, open, deadline, judgement);
        });
        judge_late(context, index, with_origin, judgement);
        if (callback.outside && callback.outside->max_response) {
          const auto& longest = *callback.outside->max_response;
          judge_outside(longest, deadline, missed_at_least(with_origin, longest.value),
                        ended_before(context, index, longest), judgement);
        }
        judgement.unseen(calculated_releases(callback));
        const auto unbounded = callback.without_upper_bound - callback.with_doubtful_bound;
        if (unbounded != 0) {
          judgement.unseen(evidence("callback_start", callback.starts.first_at,
                                    note("responses-unbounded", {{"instances", unbounded}})));
        }
        judgement.unseen(bounds_by_a_set_clock(callback));
        const auto& upper = callback.max_response_upper;
        const auto error = callback.release_error() + callback.release_spread();
        if (upper && (upper->value + error).ns > deadline) {
          judgement.unseen(
              start_of(*upper, note("response-up-to", {{"response", upper->value},
                                                       {"error", error_of(callback)},
                                                       {"deadline", Duration{deadline}}})));
        }
      });
}

// An instance that never ended, as the totals prove, and executed for longer than `spec` allows.
void judge_unended_budget(const RuleContext& context, CallbackIndex index, std::int64_t wcet,
                          const std::string& spec, Judgement& judgement) {
  const auto& callback = context.model.callbacks[at(index)];
  if (!has_unended(callback)) return;
  for (const auto& open : callback.open) {
    if (!open.executed || open.executed->first.ns <= wcet) continue;
    judgement.checked();
    const auto until = open.executed->second;
    judgement.violation(
        std::vector{
            evidence("callback_start", open.start,
                     note("executes-and-never-ends", {{"seq", open.seq}})),
            without_event(moment(until, open.start.tid),
                          note("budget-exceeded-until-here", {{"execution", open.executed->first},
                                                              {"spec", spec},
                                                              {"wcet", Duration{wcet}}}))},
        {{hidden(EventKind::run_end, context.known.scope_of(index), open.start.time, until)}});
  }
}

std::vector<SubjectVerdict> judge_budget(const RuleContext& context) {
  const bool is_any_specified = specifies_any(context, asks_for_budget);
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (is_any_specified) judgement.unseen(unknown_entry(context, callback, asks_for_budget));
        const auto* entry = spec_entry(context, callback);
        if (entry == nullptr || !entry->wcet_ns) return;
        const auto wcet = *entry->wcet_ns;
        judgement.checked(callback.instances);
        judgement.needs(context.known.lost_end(index));
        const auto& longest = callback.max_execution;
        const auto& own = callback.own ? callback.own->max_execution : longest;
        const auto spec = place(context, entry->line);
        const auto took = [&spec, wcet](const Extreme<Duration>& extreme) {
          return note("budget-exceeded",
                      {{"execution", extreme.value}, {"spec", spec}, {"wcet", Duration{wcet}}});
        };
        judge_unended_budget(context, index, wcet, spec, judgement);
        if (own && own->value.ns > wcet) {
          judgement.violation(shown_by(*own, took(*own)), ended_before(context, index, *own));
        } else if (longest && longest->value.ns > wcet) {
          doubt_others(callback, took(*longest), judgement);
        }
        if (callback.outside && callback.outside->max_execution) {
          const auto& executed = *callback.outside->max_execution;
          judge_outside(executed, wcet, took(executed), ended_before(context, index, executed),
                        judgement);
        }
        const auto& unmeasured = callback.max_duration_without_execution;
        if (unmeasured && unmeasured->value.ns > wcet) {
          judgement.unseen(start_of(
              *unmeasured, note("execution-unknown",
                                {{"duration", unmeasured->value}, {"wcet", Duration{wcet}}})));
        }
      });
}

}  // namespace

const Rule kDeadline{
    .id = kDeadlineRule,
    .name = "deadline",
    .meaning =
        "Response times stay within the deadline: response_deadline of the spec, else the one the "
        "callback declared. Where a release is not known, FAIL needs the lower bound of the "
        "response time above the deadline and PASS the upper bound within it. An instance that "
        "never ended, as callback_fini tells, fails when the window ends after its deadline; without "
        "that (a crash, or the recording stopped first) when an event of its process shows that it "
        "went on beyond the deadline, and is not judged otherwise. One outside of what all streams "
        "cover is not counted, and fails if it was late.",
    .why_it_matters = "A result after its deadline is a wrong result.",
    .inconclusive_when =
        "the bounds of a response time lie on both sides of the deadline or it has no upper one, a timer of ROS 2 may "
        "have been reset, CLOCK_REALTIME was set "
        "between the writing of a message and its taking (a clock_sync shows it), instances were "
        "lost, or the end of one that is open beyond its deadline may be missing.",
    .remedy =
        "the evidence names the instance: cie report tells what it waited for, cie analyze "
        "schedulability what it may have to wait for at worst.",
    .violation = "missed deadlines",
    .gravity = 1,
    .main_evidence = 1,
    .judge = judge_deadline,
    .needs = {.instances = true}};

const Rule kBudget{
    .id = kBudgetRule,
    .name = "budget",
    .meaning =
        "Execution times (on-CPU time, not duration) stay within the declared wcet. Where the "
        "kernel's record of an instance has a hole, lacks a CPU that it may have run on, or is "
        "absent, the instance passes if its whole duration does. One that never ended fails if it "
        "executed too long all the same; one outside of what all streams cover is not counted, and "
        "fails if it took too long.",
    .why_it_matters =
        "Budgets and response-time analyses rest on the wcet: one callback that takes more "
        "invalidates the bounds of all below it.",
    .inconclusive_when =
        "an instance took longer than the wcet and its CPU time is not known, or instances were "
        "lost.",
    .remedy =
        "record with --kernel; make the callback faster, or declare what it really takes and "
        "analyze again.",
    .violation = "exceeded the budget",
    .main_evidence = 1,
    .judge = judge_budget,
    .needs = {.instances = true, .spec = true}};

}  // namespace cie::analysis
