// Verdicts in the formats of `cie verify`. Pure functions, as those of report_writers.hpp.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace cie::viewer_export {

// `cie.verify/2`: every rule, every subject, all evidence; of the report, what recordings say of
// themselves.
void write_verify_json(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report = {});

// JUnit XML as continuous integration reads it: one suite per rule, one case per subject. FAIL is a
// failure, INCONCLUSIVE an error, never skipped; only what is not applicable is skipped.
void write_verify_junit(std::ostream& out, const analysis::VerdictReport& verdicts,
                        const analysis::Report& report);

// SARIF 2.1.0 (https://docs.oasis-open.org/sarif/sarif/v2.1.0/): one result per subject, of kind
// fail, open (inconclusive), pass or notApplicable; evidence as related locations; the rules' pages
// as their help.
void write_verify_sarif(std::ostream& out, const analysis::VerdictReport& verdicts,
                        const analysis::Report& report);

// TAP 13 (https://testanything.org): one test per subject; FAIL and INCONCLUSIVE are "not ok", told
// apart by the severity of their diagnostics.
void write_verify_tap(std::ostream& out, const analysis::VerdictReport& verdicts,
                      const analysis::Report& report);

// A callback's run that took longest, as far as is certain.
struct WorstRun {
  analysis::CallbackIndex callback{};
  std::uint64_t seq = 0;
  analysis::Timestamp start;
  analysis::Duration response_time;
  std::optional<analysis::Duration> start_latency{};  // empty: its release is not known exactly
  std::optional<analysis::Duration> execution{};      // these four with the kernel's events
  std::optional<analysis::Duration> blocked{};
  std::optional<analysis::Duration> wake_delay{};
  std::optional<analysis::Duration> preempted{};
  std::string preempted_by{};  // the thread that ran instead the longest, and for how much of it
  analysis::Duration preempted_by_time{};
  analysis::Duration idle{};  // of `preempted`: its CPU was idle, so nobody preempted it
  // What its thread ran for most of the latency, and for how much of it.
  struct Behind {
    analysis::CallbackIndex callback{};
    analysis::Duration time{};
    bool is_at_least = false;  // more runs came in between than are remembered
  };
  std::optional<Behind> behind{};
};

// What the text says besides the verdicts.
struct VerifyContext {
  std::string spec_name{};               // empty: no spec was given
  std::string spec_sha256{};             // of its bytes, lower-case hex
  const SchedulingSpec* spec = nullptr;  // borrowed: where a deadline stands
  std::vector<WorstRun> worst_runs{};
  // What follows `cie verify` and `cie view` to look at the same, printable.
  std::string verify_arguments{};
  std::string view_arguments{};
  std::string reader_arguments{};  // of these, those that say how to read
};

// For people, one screen of at most 23 lines: the gravest fact, a block per violated rule with the
// worst of its subjects, what is undecided and why, what to do next, and what was checked.
void write_verify_screen(std::ostream& out, const analysis::VerdictReport& verdicts,
                         const analysis::Report& report, const VerifyContext& context,
                         const TextStyle& style);

// The first of it in one line, with the rules.
void write_verify_line(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report, const VerifyContext& context,
                       const TextStyle& style);

// For people, all there is: the verdict first, then one line per failing or inconclusive rule and
// subject with its evidence and a babeltrace2 command that shows the events around it, then a
// summary.
void write_verify_text(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report, const VerifyContext& context,
                       const TextStyle& style);

}  // namespace cie::viewer_export
