#include <cie/analysis/report_fields.hpp>
#include <cie/analysis/verdict_fields.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "documents.hpp"
#include "recording_json.hpp"
#include "row_json.hpp"

namespace cie::viewer_export {
namespace {

// A program without verdict-bearing rules passed: the contract knows three overall verdicts.
analysis::Verdict overall(analysis::Verdict verdict) {
  using analysis::Verdict;
  return verdict == Verdict::not_applicable ? Verdict::pass : verdict;
}

}  // namespace

void write_verdicts(JsonText& json, const analysis::VerdictReport& verdicts,
                    const analysis::Report& report) {
  const RowContext context;
  RowWriter document(json, context);
  json.object([&] {
    document("schema", std::string_view("cie.verify/2"));
    document("verdict", overall(verdicts.verdict));
    document("rules", verdicts.rules);
    document.present("window", verdicts.window);
    document.present("outside_window", report.trace.outside);
    document.present("suppressions", verdicts.suppressions);
    write_recordings(document, report.recordings);
  });
}

void write_verify_json(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report) {
  JsonText json(out);
  write_verdicts(json, verdicts, report);
  json.flush();
  out << '\n';
}

}  // namespace cie::viewer_export
