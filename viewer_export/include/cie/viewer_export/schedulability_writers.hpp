// Schedulability in the formats of `cie analyze schedulability`. Pure functions, as those of
// report_writers.hpp.
#pragma once

#include <cie/analysis/schedulability.hpp>
#include <cie/viewer_export/text_style.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include <ostream>

namespace cie::viewer_export {

// For people, one screen of at most 23 lines: the outcome, the worst callbacks with their bounds and
// what was observed, why the worst is as it is, and what has no bound and why. Of `context` the worst
// runs and the arguments count.
void write_schedulability_screen(std::ostream& out, const analysis::SchedulabilityReport& report,
                                 const analysis::Report& of,
                                 const analysis::VerdictReport& verdicts,
                                 const VerifyContext& context, const TextStyle& style);

// For people, everything: the outcome, what is above its bound and why, what has no bound and why, a
// row per callback, the worst first, and what is in no bound.
// `of` is the report that was analysed.
void write_schedulability_text(std::ostream& out, const analysis::SchedulabilityReport& report,
                               const analysis::Report& of, const TextStyle& style);

// `cie.schedulability/1`: everything; times in nanoseconds, null for what is not known.
void write_schedulability_json(std::ostream& out, const analysis::SchedulabilityReport& report,
                               const analysis::Report& of);

}  // namespace cie::viewer_export
