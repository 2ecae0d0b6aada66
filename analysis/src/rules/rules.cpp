#include <cie/analysis/rule_pages.hpp>

#include "completeness_rules.hpp"
#include "execution_rules.hpp"
#include "foreign_work_rule.hpp"
#include "judgement.hpp"
#include "mapping_rules.hpp"
#include "message_rules.hpp"
#include "model/natural_order.hpp"
#include "model/sort_rows.hpp"
#include "ownership_rules.hpp"
#include "parameter_rules.hpp"
#include "persistence_rule.hpp"
#include "rate_rules.hpp"
#include "response_rules.hpp"
#include "restart_rule.hpp"
#include "rule.hpp"
#include "stability_rules.hpp"
#include "trace_rules.hpp"
#include "unseen_subjects.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace cie::analysis {
namespace {

bool comes_before(const SubjectVerdict& a, const SubjectVerdict& b) {
  if (const auto order = natural_order(a.subject, b.subject); order != 0) return order < 0;
  if (const auto order = natural_order(a.ordinal, b.ordinal); order != 0) return order < 0;
  const auto key = [](const SubjectVerdict& verdict) {
    const auto* first = verdict.evidence.empty() ? nullptr : verdict.evidence.data();
    return std::tuple(std::string_view(verdict.subject), verdict.verdict, verdict.checked,
                      first == nullptr ? Timestamp{} : first->time,
                      first == nullptr ? Note{} : first->note, verdict.about.index);
  };
  return key(a) < key(b);
}

void leave_out_passes(std::vector<SubjectVerdict>& subjects) {
  std::erase_if(subjects, [](const SubjectVerdict& subject) {
    return subject.verdict < Verdict::inconclusive;
  });
  subjects.shrink_to_fit();
}

// What every claim presupposes: that the events are the subject's, and their order known.
void presuppose(const Rule& rule, const RuleContext& context, SubjectVerdict& subject) {
  const auto& about = subject.about;
  const bool is_of_recording = rule.needs.is_about_trace && about.kind == SubjectKind::trace;
  if (is_of_recording || subject.verdict == Verdict::not_applicable) return;
  auto presupposed = context.known.misattributed(about, !rule.needs.is_about_trace);
  if (subject.verdict == Verdict::fail && about.kind == SubjectKind::callback && about.index)
    presupposed.push_back(context.known.other_account(CallbackIndex{*about.index}));
  if (auto why = context.known.why_hidden(presupposed)) {
    subject.verdict = Verdict::inconclusive;
    subject.evidence.insert(subject.evidence.begin(), *std::move(why));
  }
}

RuleVerdict judge(const Rule& rule, const RuleContext& context, const UnseenSubjects& unseen) {
  RuleVerdict verdict{
      .id = std::string(rule.id), .name = std::string(rule.name), .subjects = rule.judge(context)};
  for (auto& subject : verdict.subjects)
    presuppose(rule, context, subject);
  unseen.add(rule, verdict.subjects);
  if (context.options.is_judged) sort_rows(verdict.subjects, comes_before);
  for (const auto& subject : verdict.subjects)
    verdict.verdict = std::max(verdict.verdict, subject.verdict);
  if (!context.options.is_judged) leave_out_passes(verdict.subjects);
  return verdict;
}

RulePage page_of(const Rule& rule) {
  RulePage page{.id = rule.id,
                .name = rule.name,
                .page = std::string(rule.meaning),
                .meaning = rule.meaning,
                .why_it_matters = rule.why_it_matters,
                .inconclusive_when = rule.inconclusive_when,
                .remedy = rule.remedy,
                .remedy_rclcpp = rule.remedy_rclcpp,
                .violation = rule.violation,
                .gravity = rule.gravity,
                .main_evidence = rule.main_evidence,
                .needs_spec = rule.needs.spec};
  const auto add = [&page](std::string_view begin, std::string_view paragraph) {
    if (!paragraph.empty()) page.page.append("\n").append(begin).append(paragraph);
  };
  add(kWhyItMatters, rule.why_it_matters);
  add(kInconclusiveWhen, rule.inconclusive_when);
  add(kRemedy, rule.remedy);
  add(kRemedyWithRclcpp, rule.remedy_rclcpp);
  return page;
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

const std::vector<RulePage>& rule_pages() {
  static const std::vector<RulePage> all = [] {
    std::vector<RulePage> pages;
    for (const auto& rule : rules())
      pages.push_back(page_of(rule));
    return pages;
  }();
  return all;
}

std::string as_rule_id(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  return text;
}

const RulePage* find_rule_page(std::string_view id) {
  const auto& pages = rule_pages();
  const auto found = std::ranges::find(pages, id, &RulePage::id);
  return found == pages.end() ? nullptr : &*found;
}

namespace {

// What leaves a rule undecided that is not about the trace itself.
void note_losses(const RuleVerdict& rule, Judgement& losses) {
  for (const auto& subject : rule.subjects) {
    if (subject.verdict != Verdict::inconclusive) continue;
    for (const auto& item : subject.evidence)
      if (item.is_user_loss) losses.unseen(item);
  }
}

// T2: a loss costs what a rule is undecided by.
void doubt_losses(VerdictReport& report, Judgement&& losses) {
  const auto no_loss = std::ranges::find(report.rules, kNoLoss.id, &RuleVerdict::id);
  const bool is_passed = no_loss != report.rules.end() && no_loss->verdict == Verdict::pass;
  if (!is_passed || no_loss->subjects.empty()) return;
  losses.checked(no_loss->subjects.front().checked);
  auto verdict = std::move(losses).finish();
  if (verdict->verdict == Verdict::pass) return;
  no_loss->verdict = verdict->verdict;
  no_loss->subjects.front() = *std::move(verdict);
}

}  // namespace

VerdictReport verify(const RuleContext& context) {
  VerdictReport report;
  const UnseenSubjects unseen(context);
  Judgement losses(NamedSubject::trace(), context.known);
  for (const auto& rule : rules()) {
    if (!context.options.is_judged && !rule.needs.is_of_report) continue;
    report.rules.push_back(judge(rule, context, unseen));
    if (!rule.needs.is_about_trace) note_losses(report.rules.back(), losses);
  }
  doubt_losses(report, std::move(losses));
  report.verdict = overall_verdict(report);
  return report;
}

}  // namespace cie::analysis
