#include <cie/analysis/verdict_fields.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "json.hpp"
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

Json verify_json(const analysis::VerdictReport& verdicts, const analysis::Report& report) {
  Json json{{"schema", "cie.verify/2"}};
  const RowContext context;
  RowWriter document(json, context);
  document("verdict", overall(verdicts.verdict));
  document("rules", verdicts.rules);
  document.present("window", verdicts.window);
  document.present("suppressions", verdicts.suppressions);
  add_recordings(json, report.recordings);
  return json;
}

void write_verify_json(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report) {
  write_json(out, verify_json(verdicts, report));
}

}  // namespace cie::viewer_export
