// Schedulability in the formats of `cie analyze schedulability`. Pure functions, as those of
// report_writers.hpp.
#pragma once

#include <cie/analysis/schedulability.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <ostream>

namespace cie::viewer_export {

// For people: the outcome, a row per callback with its bound and what was observed, then what has
// no bound and why, what is above its bound and why, and what is in no bound.
// `of` is the report that was analysed.
void write_schedulability_text(std::ostream& out, const analysis::SchedulabilityReport& report,
                               const analysis::Report& of, const TextStyle& style);

// `cie.schedulability/1`: everything; times in nanoseconds, null for what is not known.
void write_schedulability_json(std::ostream& out, const analysis::SchedulabilityReport& report,
                               const analysis::Report& of);

}  // namespace cie::viewer_export
