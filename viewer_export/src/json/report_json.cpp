#include <cie/analysis/report_fields.hpp>
#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "json.hpp"
#include "recording_json.hpp"
#include "row_json.hpp"

namespace cie::viewer_export {

Json report_json(const analysis::Report& report) {
  const analysis::ReportRows rows(report);
  const RowContext context{.rows = &rows, .has_several_hosts = report.trace.hosts.size() > 1};
  Json json{{"schema", "cie.report/2"}, {"tool", {{"name", "cie"}, {"version", tool_version()}}}};
  RowWriter document(json, context);
  document("trace", report.trace);
  document("defects", report.defects);
  document("processes", report.processes);
  document("callbacks", report.callbacks);
  document("threads", report.threads);
  document("chains", report.chains);
  document("edges", report.edges);
  if (!report.clocks.empty()) document("clocks", report.clocks);
  add_recordings(json, report.recordings);
  return json;
}

void write_report_json(std::ostream& out, const analysis::Report& report) {
  write_json(out, report_json(report));
}

}  // namespace cie::viewer_export
