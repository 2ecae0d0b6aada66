#include <cie/analysis/report_fields.hpp>
#include <cie/analysis/verdict_fields.hpp>
#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "documents.hpp"
#include "recording_json.hpp"
#include "row_json.hpp"

namespace cie::viewer_export {

void write_report(JsonText& json, const analysis::Report& report) {
  const analysis::ReportRows rows(report);
  const RowContext context{.rows = &rows, .has_several_hosts = report.trace.hosts.size() > 1};
  RowWriter document(json, context);
  json.object([&] {
    document("schema", std::string_view("cie.report/2"));
    json.key("tool");
    json.object([&] {
      document("name", std::string_view("cie"));
      document("version", tool_version());
    });
    document("trace", report.trace);
    document.present("window", analysis::asked_window(report.trace));
    document.present("outside_window", report.trace.outside);
    document("defects", report.defects);
    document("processes", report.processes);
    document("callbacks", report.callbacks);
    document("threads", report.threads);
    document("chains", report.chains);
    document("edges", report.edges);
    document.present("taken", analysis::taken_unrecorded(report));
    if (!report.clocks.empty()) document("clocks", report.clocks);
    write_recordings(document, report.recordings);
  });
}

void write_report_json(std::ostream& out, const analysis::Report& report) {
  JsonText json(out);
  write_report(json, report);
  json.flush();
  out << '\n';
}

}  // namespace cie::viewer_export
