// What to do about a violated rule.
#include <cie/analysis/comparison.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "tables/report_tables.hpp"
#include "verify_findings.hpp"
#include "verify_subjects.hpp"
#include "words/verify_words.hpp"

#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::RuleVerdict;
using analysis::Verdict;

// What releases callbacks of that kind less often.
std::string_view slower_source(CallbackKind kind) {
  switch (kind) {
    case CallbackKind::timer:
      return "give it a longer period";
    case CallbackKind::subscription:
      return "let its publishers send less often";
    case CallbackKind::service:
      return "let its clients ask less often";
    case CallbackKind::client:
      return "let it ask less often";
    case CallbackKind::waitable:
      return "let what it waits for (goals, events) come less often";
  }
  return {};
}

// Of R1, where those that violate it are of one kind; empty: they are not.
std::string remedy_of_arrivals(const Judged& judged, const RuleVerdict& rule) {
  std::optional<CallbackKind> kind;
  for (const auto& subject : rule.subjects) {
    if (!counts(subject, Verdict::fail)) continue;
    const auto* callback = reported_callback(judged, subject);
    if (callback == nullptr || !callback->kind || kind.value_or(*callback->kind) != *callback->kind)
      return {};
    kind = callback->kind;
  }
  if (!kind) return {};
  return fmt::format(
      "shorten the callback, raise its priority or give it a CPU, or {}; cie report shows where the "
      "time went",
      slower_source(*kind));
}

}  // namespace

std::string remedy_of(const Judged& judged, const Finding& finding) {
  const auto& id = finding.rule->id;
  if (id == analysis::kArrivalExceedsTurnaroundRule) {
    if (auto remedy = remedy_of_arrivals(judged, *finding.rule); !remedy.empty()) return remedy;
  }
  if (id == analysis::kSpecifiedCallbackSeenRule && are_all_registered(*finding.rule))
    return "let the recording last until the callback has run, or remove its entry";
  if (const auto remedy = remedy_of_refusal(*finding.rule); !remedy.empty())
    return std::string(remedy);
  const auto executor = executor_of(*finding.rule, judged.report);
  // Groups of several callbacks do not explain it.
  const bool is_isolated = executor == ExecutorSeen::isolated;
  const bool is_alone = id == analysis::kOneThreadPerCallbackRule && is_isolated &&
                        !is_any_thread_shared(judged.report);
  const bool is_none = executor == ExecutorSeen::none;
  if (is_none || is_alone ||
      (id != analysis::kOneCallbackPerThreadRule && id != analysis::kOneThreadPerCallbackRule)) {
    std::string text(remedy_of_rule(id, is_none || is_alone));
    if (text.ends_with('.')) text.pop_back();
    return text;
  }
  return is_isolated ? "give each callback a callback group of its own"
                     : "run with --executor isolated";
}

}  // namespace cie::viewer_export
