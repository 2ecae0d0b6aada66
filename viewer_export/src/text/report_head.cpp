#include "report_head.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "tables/report_tables.hpp"
#include "words/verify_words.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

bool is_isolation_claimed(const analysis::Report& report, const ReportContext& context) {
  return context.is_isolation_expected || context.verify.spec != nullptr ||
         std::ranges::any_of(report.processes, analysis::is_isolated_executor_alone);
}

// A deadline is claimed by whoever declares it; by an isolated executor what its threads are for.
bool is_claimed(const analysis::RuleVerdict& rule, const analysis::ReportRows& rows) {
  return rule.id == analysis::kDeadlineRule ||
         std::ranges::any_of(rule.subjects, [&rows](const auto& subject) {
           return subject.verdict == analysis::Verdict::fail && !subject.is_suppressed() &&
                  is_of_isolated_executor(subject, rows);
         });
}

}  // namespace

ReportHead report_head(const Judged& judged, const ReportContext& context) {
  using analysis::Isolation;
  const auto& report = judged.report;
  ReportHead head{.is_isolation_claimed = is_isolation_claimed(report, context),
                  .findings = findings_of(judged),
                  .isolation = isolation_seen(judged)};
  if (head.is_isolation_claimed) return head;
  const analysis::ReportRows rows(report);
  std::erase_if(head.findings,
                [&rows](const auto& finding) { return !is_claimed(*finding.rule, rows); });
  if (const auto shared = callbacks_with(report, Isolation::not_isolated); shared > 0) {
    const auto ran = std::ssize(report.callbacks) - callbacks_with(report, Isolation::never_ran);
    head.isolation = fmt::format(
        "callbacks {}: {} of {}",
        is_any_thread_shared(report) ? "share threads" : "on several threads", shared, ran);
  }
  return head;
}

}  // namespace cie::viewer_export
