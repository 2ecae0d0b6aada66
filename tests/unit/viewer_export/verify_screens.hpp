// verify's screen and line of a sample, as text.
#pragma once

#include <cie/viewer_export/verify_writers.hpp>

#include <sstream>
#include <string>

namespace cie::viewer_export {

inline VerifyContext usual_verify_context() {
  return {.spec_name = {},
          .spec_sha256 = {},
          .worst_runs = {},
          .verify_arguments = "'recordings/run 1' --only M2",
          .view_arguments = "'recordings/run 1'"};
}

inline std::string screen_of(const analysis::VerdictReport& verdicts,
                             const analysis::Report& report, const TextStyle& style = {},
                             const VerifyContext& context = usual_verify_context()) {
  std::ostringstream out;
  write_verify_screen(out, verdicts, report, context, style);
  return out.str();
}

inline analysis::SubjectVerdict judged(analysis::SubjectKind kind, const char* subject,
                                       analysis::Verdict verdict) {
  return {.about = {.kind = kind},
          .subject = subject,
          .verdict = verdict,
          .evidence = {{.event = "x",
                        .time = analysis::Timestamp{1},
                        .cpu = {},
                        .pid = {},
                        .tid = {},
                        .note = analysis::free_text("n")}}};
}

inline std::string line_of(const analysis::VerdictReport& verdicts,
                           const analysis::Report& report) {
  std::ostringstream out;
  write_verify_line(out, verdicts, report, usual_verify_context(), {});
  return out.str();
}

}  // namespace cie::viewer_export
