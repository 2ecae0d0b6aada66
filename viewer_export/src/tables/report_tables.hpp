// The tables of the text report.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/viewer_export/text_style.hpp>

#include "words/text_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_set>

namespace cie::viewer_export {

// `pid 4001 "demo" on robot, isolated executor`.
std::string process_title(const analysis::ProcessReport& process);
// The logical id, with the pid when the report has several processes.
std::string callback_title(const analysis::Report& report,
                           const analysis::CallbackReport& callback);

// Whether a quantile or the max of its response times is known as a lower bound alone: of instances
// whose release is not known some may have taken longer.
bool is_lower_bound(const analysis::CallbackReport& callback,
                    std::int64_t analysis::Summary::*part);
// A quantile or the max of its response times; marked as a bound where instances whose release is
// not known took longer.
TextCell response_cell(const analysis::CallbackReport& callback,
                       std::int64_t analysis::Summary::*part,
                       std::string (*format)(std::int64_t ns));
// Where its longest response time is a bound, what it is at most.
std::optional<std::int64_t> longest_at_most(const analysis::CallbackReport& callback);
TextCell at_most_cell(const analysis::CallbackReport& callback,
                      std::string (*format)(std::int64_t ns));
// "7", and "7+1" of such that ended and such that did not, or are cut by an edge of the window.
std::string whole_and_other(std::uint64_t whole, std::uint64_t other);
// How many of its instances are certainly beyond the deadline.
TextCell late_runs_cell(const analysis::CallbackReport& callback);
// Releases that callbacks missed; bad if these are more than they may (R2).
class MissedCells {
 public:
  // Null: nobody judged.
  explicit MissedCells(const analysis::VerdictReport* verdicts);
  TextCell of(const analysis::CallbackReport& callback) const;

 private:
  std::unordered_set<std::uint32_t> too_many_;  // indices of callbacks
};

// How many callbacks are isolated, not isolated, or never ran.
std::ptrdiff_t callbacks_with(const analysis::Report& report, analysis::Isolation isolation);
// Whether any thread ran several callbacks: not all that lack a thread of their own share one.
bool is_any_thread_shared(const analysis::Report& report);

// Each with its title and a blank line at the end; empty when there is nothing to show.
std::string callback_tables(const analysis::Report& report, const analysis::VerdictReport* verdicts,
                            const TextStyle& style);
std::string thread_tables(const analysis::Report& report, const TextStyle& style);
std::string chain_tables(const analysis::Report& report, const TextStyle& style);
// How far hosts' clocks differ, as far as messages tell; empty if none went between hosts.
std::string clock_lines(const analysis::Report& report, const TextStyle& style);

}  // namespace cie::viewer_export
