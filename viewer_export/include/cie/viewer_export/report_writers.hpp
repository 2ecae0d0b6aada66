// The report in the formats of `cie report`. Pure functions: the same report gives the same bytes.
// They throw what the stream throws when writing fails, and nothing else but std::bad_alloc.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/viewer_export/text_style.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include <ostream>
#include <string_view>

namespace cie::viewer_export {

// `cie.report/2`: every key of the contract, times in nanoseconds, null for "not measured". Invalid
// UTF-8 of hostile names becomes U+FFFD.
void write_report_json(std::ostream& out, const analysis::Report& report);

// What the screen says besides the report and its verdicts.
struct ReportContext {
  // Its arguments follow `cie report`, too.
  VerifyContext verify{};
  // Shared threads are a violation, also where neither the executor nor a spec claims there are none.
  bool is_isolation_expected = false;
};

// For people, one screen of at most 23 lines: what is worst in words, what was recorded, the worst
// callbacks and chains with their times, why the worst run took as long, and the commands for more.
void write_report_screen(std::ostream& out, const analysis::Report& report,
                         const analysis::VerdictReport& verdicts, const ReportContext& context,
                         const TextStyle& style);

// For people, all threads: what each was told to run as, and what it ran.
void write_report_threads(std::ostream& out, const analysis::Report& report,
                          const TextStyle& style);

// For people, each chain with its hops.
void write_report_chains(std::ostream& out, const analysis::Report& report, const TextStyle& style);

// For people, all there is, by logical ids: verdict (when given; borrowed, may be null), what to
// look at first, the recording and its defects, callbacks, threads, chains, and what the dashes
// mean. Names from traces cannot move the cursor. `input` follows commands that are to be pasted: traces and the options that they were
// read by, for a shell.
void write_report_text(std::ostream& out, const analysis::Report& report,
                       const analysis::VerdictReport* verdicts, const TextStyle& style,
                       std::string_view input = "TRACE");

// One row per callback with a header (RFC 4180): times in nanoseconds, empty for "not measured".
void write_report_csv(std::ostream& out, const analysis::Report& report);

}  // namespace cie::viewer_export
