// The report in the formats of `cie report`. Pure functions: the same report gives the same bytes.
// They throw what the stream throws when writing fails, and nothing else but std::bad_alloc.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <ostream>
#include <string_view>

namespace cie::viewer_export {

// `cie.report/2`: every key of the contract, times in nanoseconds, null for "not measured". Invalid
// UTF-8 of hostile names becomes U+FFFD.
void write_report_json(std::ostream& out, const analysis::Report& report);

// For people: verdict (when given; borrowed, may be null), what to look at first, the recording and
// its defects, callbacks, threads, chains, and what the dashes mean. Names from traces cannot move
// the cursor. `input` follows commands that are to be pasted: traces and the options that they were
// read by, for a shell.
void write_report_text(std::ostream& out, const analysis::Report& report,
                       const analysis::VerdictReport* verdicts, const TextStyle& style,
                       std::string_view input = "TRACE");

// One row per callback with a header (RFC 4180): times in nanoseconds, empty for "not measured".
void write_report_csv(std::ostream& out, const analysis::Report& report);

}  // namespace cie::viewer_export
