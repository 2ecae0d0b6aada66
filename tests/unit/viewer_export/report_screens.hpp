// The report's first screen of a sample, as text.
#pragma once

#include <cie/viewer_export/report_writers.hpp>

#include "sample_report.hpp"

#include <sstream>
#include <string>

namespace cie::viewer_export {

// Of the callback that took longest.
inline ReportContext usual_context() {
  return {.verify = {.spec_name = {},
                     .spec_sha256 = {},
                     .worst_runs = {{.callback = analysis::CallbackIndex{1},
                                     .seq = 3,
                                     .start = {983'001'500'000},
                                     .response_time = {2'500'000},
                                     .preempted = analysis::Duration{200'000},
                                     .preempted_by = "cc1plus",
                                     .preempted_by_time = {200'000}}},
                     .verify_arguments = "'recordings/run 1' --window=+1s..",
                     .view_arguments = "'recordings/run 1'"}};
}

inline std::string screen_of(const analysis::Report& report,
                             const analysis::VerdictReport& verdicts, const TextStyle& style = {},
                             const ReportContext& context = usual_context()) {
  std::ostringstream out;
  write_report_screen(out, report, verdicts, context, style);
  return out.str();
}

// Both callbacks ran on the second thread; of the first one's seven runs none did as it says.
inline analysis::Report shared_report() {
  auto report = test::sample_report();
  report.threads[1].ran = {analysis::CallbackIndex{0}, analysis::CallbackIndex{1}};
  return report;
}

// A multi-threaded system, which nobody said anything else of.
inline analysis::Report unclaimed_report() {
  auto report = shared_report();
  report.processes[0].executor = "multi_threaded";
  return report;
}

}  // namespace cie::viewer_export
