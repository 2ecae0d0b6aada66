#include "report_head.hpp"

#include <cie/analysis/rule_pages.hpp>

#include "tables/report_tables.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

bool is_isolation_claimed(const analysis::Report& report, const ReportContext& context) {
  return context.is_isolation_expected || context.verify.spec != nullptr ||
         std::ranges::any_of(report.processes,
                             [](const auto& process) { return process.executor == "isolated"; });
}

}  // namespace

ReportHead report_head(const Judged& judged, const ReportContext& context) {
  using analysis::Isolation;
  const auto& report = judged.report;
  ReportHead head{.is_isolation_claimed = is_isolation_claimed(report, context),
                  .findings = findings_of(judged),
                  .isolation = isolation_seen(judged)};
  if (head.is_isolation_claimed) return head;
  // A deadline is claimed by whoever declares it.
  std::erase_if(head.findings,
                [](const auto& finding) { return finding.rule->id != analysis::kDeadlineRule; });
  if (const auto shared = callbacks_with(report, Isolation::not_isolated); shared > 0) {
    const auto ran = std::ssize(report.callbacks) - callbacks_with(report, Isolation::never_ran);
    head.isolation = fmt::format(
        "callbacks {}: {} of {}",
        is_any_thread_shared(report) ? "share threads" : "on several threads", shared, ran);
  }
  return head;
}

}  // namespace cie::viewer_export
