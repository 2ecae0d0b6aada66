#include "report_head.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "tables/report_tables.hpp"
#include "words/verify_words.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

// Of every callback that was recorded.
bool is_isolation_claimed_of_all(const ReportContext& context) {
  return context.is_isolation_expected || context.verify.spec != nullptr;
}

// Callbacks of a process whose only executor is not the isolated one share threads.
bool do_others_share(const analysis::Report& report, const analysis::ReportRows& rows) {
  return std::ranges::any_of(report.callbacks, [&rows](const auto& callback) {
    return callback.isolation == analysis::Isolation::not_isolated &&
           !is_isolated_executor_alone(rows.process_of(callback));
  });
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
  ReportHead head{.is_isolation_claimed = is_isolation_claimed_of_all(context),
                  .findings = findings_of(judged),
                  .isolation = isolation_seen(judged)};
  if (head.is_isolation_claimed) return head;
  const analysis::ReportRows rows(report);
  const auto unclaimed = std::erase_if(
      head.findings, [&rows](const auto& finding) { return !is_claimed(*finding.rule, rows); });
  if (std::ranges::any_of(report.processes, analysis::is_isolated_executor_alone) &&
      unclaimed == 0 && !do_others_share(report, rows)) {
    head.is_isolation_claimed = true;
    return head;
  }
  if (const auto shared = callbacks_with(report, Isolation::not_isolated); shared > 0) {
    const auto ran = std::ssize(report.callbacks) - callbacks_with(report, Isolation::never_ran);
    head.isolation = fmt::format(
        "callbacks {}: {} of {}",
        is_any_thread_shared(report) ? "share threads" : "on several threads", shared, ran);
  }
  return head;
}

}  // namespace cie::viewer_export
