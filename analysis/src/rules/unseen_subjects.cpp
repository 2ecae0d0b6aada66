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

void add_of_trace(const RuleContext& context, Evidence unseen,
                  std::vector<SubjectVerdict>& subjects) {
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
  add_of_trace(
      context,
      without_event(moment(model.begin), note(has_outside ? "no-start-in-window" : "no-starts")),
      subjects);
}

// What belongs to no process may have been anybody's instances.
void add_events_without_pid(const RuleContext& context, std::vector<SubjectVerdict>& subjects) {
  const auto without = context.model.events.cie_without_pid;
  if (without == 0) return;
  add_of_trace(context,
               without_event(moment(context.model.begin),
                             note("events-without-vpid", {{"events", without}})),
               subjects);
}

std::optional<Note> not_here(const std::optional<std::string>& what) {
  return what ? std::optional(note("part-missing", {{"text", *what}})) : std::nullopt;
}

std::optional<Note> not_recorded(const std::vector<RecorderFailure>& failures) {
  if (failures.empty()) return std::nullopt;
  const auto& first = failures.front();
  return note("not-all-recorded", {{"text", in_words(first, first.problems.front())}});
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

UnseenSubjects::UnseenSubjects(const RuleContext& context)
    : context_(context),
      missing_of_user_(not_here(missing_user_part(context.model))),
      missing_of_kernel_(not_here(missing_kernel_part(context.model))),
      missing_of_recorder_(not_recorded(context.proof.recorder_losses())) {}

void UnseenSubjects::add(const Rule& rule, std::vector<SubjectVerdict>& subjects) const {
  const bool is_judged = context_.options.spec != nullptr || !rule.needs.spec;
  if (rule.needs.instances) add_absent_starts(context_, subjects);
  if (rule.needs.instances && is_judged) add_events_without_pid(context_, subjects);
  if (is_judged) add_missing_part(rule, subjects);
  join_those_of_trace(subjects);
}

const std::optional<Note>& UnseenSubjects::missing_part(const Rule& rule) const {
  if (missing_of_user_) return missing_of_user_;
  if (missing_of_recorder_ && !rule.needs.is_about_trace) return missing_of_recorder_;
  return rule.needs.kernel ? missing_of_kernel_ : missing_of_user_;
}

// L7: what is left does not pass in its place. A subject is judged as ever: its numbers and totals show what it lost.
void UnseenSubjects::add_missing_part(const Rule& rule,
                                      std::vector<SubjectVerdict>& subjects) const {
  const bool is_undecided = std::ranges::any_of(subjects, [](const SubjectVerdict& subject) {
    return subject.about.kind == SubjectKind::trace && subject.verdict >= Verdict::inconclusive;
  });
  if (is_undecided) return;
  if (const auto& missing = missing_part(rule))
    add_of_trace(context_, evidence("missing_part", moment(context_.model.begin), *missing),
                 subjects);
}

}  // namespace cie::analysis
