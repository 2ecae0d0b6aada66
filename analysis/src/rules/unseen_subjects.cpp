#include "unseen_subjects.hpp"

#include "judgement.hpp"
#include "model/recorded_parts.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

void add(const RuleContext& context, Evidence unseen, std::vector<SubjectVerdict>& subjects) {
  Judgement judgement(NamedSubject::trace(), context.known);
  judgement.unseen(std::move(unseen));
  conclude(std::move(judgement), subjects);
}

// Rules that judge instances have no subject at all when no start was recorded.
void add_absent_starts(const RuleContext& context, std::vector<SubjectVerdict>& subjects) {
  const auto& model = context.model;
  if (!subjects.empty() || model.events.by_name.contains("callback_start")) return;
  const auto& callbacks = model.callbacks;
  const bool has_run = std::ranges::any_of(callbacks, [](const CallbackFacts& callback) {
    return callback.ended.count != 0 || callback.starts_outside != 0 ||
           (callback.fini && callback.fini->started != 0);
  });
  if (!has_run) return;
  const bool has_outside = std::ranges::any_of(
      callbacks, [](const CallbackFacts& callback) { return callback.starts_outside != 0; });
  add(context,
      without_event(moment(model.begin), note(has_outside ? "no-start-in-window" : "no-starts")),
      subjects);
}

// What belongs to no process may have been anybody's instances.
void add_events_without_pid(const RuleContext& context, std::vector<SubjectVerdict>& subjects) {
  const auto without = context.model.events.cie_without_pid;
  if (without == 0) return;
  add(context,
      without_event(moment(context.model.begin),
                    note("events-without-vpid", {{"events", without}})),
      subjects);
}

// What manifests say was recorded and is not here, and what recorders say they did not write. That is no fault of the
// traces that are here.
std::optional<Note> missing_part(const Rule& rule, const RuleContext& context) {
  const auto not_here = [](const std::string& what) {
    return note("part-missing", {{"text", what}});
  };
  if (const auto missing = missing_user_part(context.model)) return not_here(*missing);
  const auto& failures = context.proof.recorder_losses();
  if (!failures.empty() && !rule.needs.is_about_trace) {
    return note("not-all-recorded",
                {{"text", in_words(failures.front(), failures.front().problems.front())}});
  }
  if (!rule.needs.kernel) return std::nullopt;
  const auto missing = missing_kernel_part(context.model);
  return missing ? std::optional(not_here(*missing)) : std::nullopt;
}

// L7: what is left does not pass in its place. A subject is judged as ever: its numbers and totals show what it lost.
void add_missing_part(const Rule& rule, const RuleContext& context,
                      std::vector<SubjectVerdict>& subjects) {
  const bool is_undecided = std::ranges::any_of(subjects, [](const SubjectVerdict& subject) {
    return subject.about.kind == SubjectKind::trace && subject.verdict >= Verdict::inconclusive;
  });
  if (is_undecided) return;
  if (auto missing = missing_part(rule, context)) {
    add(context, evidence("missing_part", moment(context.model.begin), *std::move(missing)),
        subjects);
  }
}

// A subject has one verdict: the worst of those of the trace, with what any of them rests on.
void join_those_of_trace(std::vector<SubjectVerdict>& subjects) {
  const auto is_of_trace = [](const SubjectVerdict& subject) {
    return subject.about.kind == SubjectKind::trace;
  };
  const auto first = std::ranges::find_if(subjects, is_of_trace);
  if (first == subjects.end()) return;
  for (auto next = std::next(first); next != subjects.end();) {
    if (!is_of_trace(*next)) {
      ++next;
      continue;
    }
    if (next->verdict > first->verdict) std::swap(*first, *next);
    first->checked += next->checked;
    std::ranges::move(next->evidence, std::back_inserter(first->evidence));
    next = subjects.erase(next);
  }
}

}  // namespace

void add_unseen_subjects(const Rule& rule, const RuleContext& context,
                         std::vector<SubjectVerdict>& subjects) {
  const bool is_judged = context.options.spec != nullptr || !rule.needs.spec;
  if (rule.needs.instances) add_absent_starts(context, subjects);
  if (rule.needs.instances && is_judged) add_events_without_pid(context, subjects);
  if (is_judged) add_missing_part(rule, context, subjects);
  join_those_of_trace(subjects);
}

}  // namespace cie::analysis
