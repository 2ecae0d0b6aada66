#include <cie/analysis/rule_pages.hpp>

#include "../subjects.hpp"
#include "completeness_rules.hpp"
#include "execution_rules.hpp"
#include "judgement.hpp"
#include "mapping_rules.hpp"
#include "message_rules.hpp"
#include "ownership_rules.hpp"
#include "parameter_rules.hpp"
#include "restart_rule.hpp"
#include "rule.hpp"
#include "stability_rules.hpp"
#include "timing_rules.hpp"
#include "trace_rules.hpp"

#include <algorithm>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Orders texts as readers expect, numbers in them by value: "thread 9" before "thread 10".
bool is_before(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    if (!is_digit(a.front()) || !is_digit(b.front())) {
      if (a.front() != b.front()) return a.front() < b.front();
      a.remove_prefix(1);
      b.remove_prefix(1);
      continue;
    }
    const auto take = [](std::string_view& text) {
      const auto end = std::min(text.find_first_not_of("0123456789"), text.size());
      auto digits = text.substr(0, end);
      text.remove_prefix(end);
      digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
      return digits;
    };
    const auto x = take(a);
    const auto y = take(b);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  return a.size() < b.size();
}

bool comes_before(const SubjectVerdict& a, const SubjectVerdict& b) {
  if (is_before(a.subject, b.subject) || is_before(b.subject, a.subject)) {
    return is_before(a.subject, b.subject);
  }
  const auto key = [](const SubjectVerdict& verdict) {
    return std::tuple(verdict.subject, verdict.verdict, verdict.checked,
                      verdict.evidence.empty() ? Timestamp{} : verdict.evidence.front().time,
                      verdict.evidence.empty() ? std::string() : verdict.evidence.front().note);
  };
  return key(a) < key(b);
}

// Rules that judge instances have no subject at all when no start was recorded.
bool judges_instances(std::string_view rule) {
  constexpr std::string_view kRules = "M2 M3 M4 M6 M9 E1 E2 E3 R1 R2 R3 R4 R5 ";
  return kRules.find(rule) != std::string_view::npos;
}

std::optional<SubjectVerdict> absent_starts(const Rule& rule, const Model& model) {
  if (!judges_instances(rule.id) || model.events.by_name.contains("callback_start")) {
    return std::nullopt;
  }
  const auto& callbacks = model.callbacks;
  const auto has_run = std::ranges::find_if(callbacks, [](const CallbackFacts& callback) {
    return callback.ends != 0 || callback.starts_outside != 0 ||
           (callback.fini && callback.fini->started != 0);
  });
  if (has_run == callbacks.end()) return std::nullopt;
  Judgement judgement("trace");
  const bool has_outside = std::ranges::any_of(
      callbacks, [](const CallbackFacts& callback) { return callback.starts_outside != 0; });
  judgement.doubt(evidence("callback_start", moment(model.begin.value_or(Timestamp{})),
                           has_outside ? "no callback started in the window"
                                       : "callbacks ran, but no callback_start was recorded"));
  return std::move(judgement).finish();
}

// Names the file and the packet of each event.
void locate(const Model& model, std::vector<Evidence>& evidence) {
  for (auto& item : evidence) {
    if (!item.stream || *item.stream >= model.streams.size()) continue;
    const auto& stream = model.streams[*item.stream];
    item.file = stream.path;
    const auto& begins = stream.packet_begins;
    const auto next = std::ranges::upper_bound(begins, item.time);
    if (next != begins.begin() && stream.packets == begins.size()) {
      item.packet = static_cast<std::uint64_t>(next - begins.begin() - 1);
    }
  }
}

// Of processes whose events cannot be told apart neither a pass nor a violation is proven. Subjects
// name their process when there are several; one that names none may be any process's.
void doubt_shared_pids(const Rule& rule, const Model& model,
                       std::vector<SubjectVerdict>& subjects) {
  const Subjects names(model);
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (!process.shares_pid_since) continue;
    const auto own = names.suffix(ProcessIndex{static_cast<std::uint32_t>(i)});
    for (auto& subject : subjects) {
      const bool is_other =
          subject.subject.find(" (pid ") != std::string::npos && !subject.subject.ends_with(own);
      const bool is_about_trace = subject.subject == "trace" && rule.id.starts_with('T');
      if (is_other || is_about_trace || subject.verdict == Verdict::not_applicable) continue;
      subject.verdict = Verdict::inconclusive;
      subject.evidence = {
          evidence("run_begin", *process.shares_pid_since,
                   "two processes have this pid: containers, which need a recording "
                   "each, or a child of fork() without exec(), which needs "
                   "LD_PRELOAD=liblttng-ust-fork.so.1")};
    }
  }
}

RuleVerdict judge(const Rule& rule, const RuleContext& context) {
  RuleVerdict verdict{
      .id = std::string(rule.id), .name = std::string(rule.name), .subjects = rule.judge(context)};
  if (verdict.subjects.empty()) {
    if (auto absent = absent_starts(rule, context.model)) verdict.subjects.push_back(*absent);
  }
  doubt_shared_pids(rule, context.model, verdict.subjects);
  std::ranges::stable_sort(verdict.subjects, comes_before);
  for (auto& subject : verdict.subjects) {
    verdict.verdict = std::max(verdict.verdict, subject.verdict);
    locate(context.model, subject.evidence);
  }
  return verdict;
}

}  // namespace

const std::vector<Rule>& rules() {
  static const std::vector<Rule> all{kTraceReadable,
                                     kNoLoss,
                                     kSeqContiguous,
                                     kRunComplete,
                                     kRequiredEvents,
                                     kTimeSane,
                                     kSpecifiedCallbackSeen,
                                     kOneCallbackPerThread,
                                     kOneThreadPerCallback,
                                     kMappingPersistent,
                                     kMappingSurvivesRestart,
                                     kNoForeignWork,
                                     kUniqueLogicalId,
                                     kSingleCallbackGroup,
                                     kThreadKnown,
                                     kParametersAsSpecified,
                                     kParametersBeforeFirstCallback,
                                     kParametersUnchanged,
                                     kAllowedCpusOnly,
                                     kNoParameterLeak,
                                     kStartEndPaired,
                                     kNonReentrant,
                                     kNoNesting,
                                     kArrivalExceedsTurnaround,
                                     kNoMissedRelease,
                                     kDeadline,
                                     kBudget,
                                     kRate,
                                     kNoQueueOverflow,
                                     kChainBounds};
  return all;
}

std::vector<RulePage> rule_pages() {
  std::vector<RulePage> pages;
  for (const auto& rule : rules()) {
    pages.push_back(RulePage{.id = rule.id, .name = rule.name, .page = rule.page});
  }
  return pages;
}

VerdictReport verify(const RuleContext& context) {
  VerdictReport report;
  for (const auto& rule : rules()) {
    report.rules.push_back(judge(rule, context));
  }
  report.verdict = overall_verdict(report);
  return report;
}

Verdict counted_verdict(const RuleVerdict& rule) noexcept {
  if (rule.subjects.empty()) return rule.verdict;
  auto verdict = Verdict::not_applicable;
  for (const auto& subject : rule.subjects) {
    if (!subject.is_suppressed()) verdict = std::max(verdict, subject.verdict);
  }
  return verdict;
}

Verdict overall_verdict(const VerdictReport& verdicts) noexcept {
  auto verdict = Verdict::pass;
  for (const auto& rule : verdicts.rules)
    verdict = std::max(verdict, counted_verdict(rule));
  return verdict;
}

std::string_view label(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::not_applicable:
      return "NOT_APPLICABLE";
    case Verdict::pass:
      return "PASS";
    case Verdict::inconclusive:
      return "INCONCLUSIVE";
    case Verdict::fail:
      return "FAIL";
  }
  return "";
}

}  // namespace cie::analysis
