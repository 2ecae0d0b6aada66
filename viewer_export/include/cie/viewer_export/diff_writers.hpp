// A comparison in the formats of `cie diff`. Pure functions, as those of report_writers.hpp.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

namespace cie::viewer_export {

// How many of the callbacks that ran had a thread of their own.
struct IsolationCount {
  std::size_t own_thread = 0;
  std::size_t ran = 0;
  std::size_t unknown = 0;  // of those that ran
  friend bool operator==(const IsolationCount&, const IsolationCount&) = default;
};
IsolationCount isolation_count(const std::vector<analysis::CallbackSample>& samples);

struct DiffContext {
  std::string before;  // what is compared, as the user named it
  std::string after;
  double tolerance = 0;
  IsolationCount isolation_before{};
  IsolationCount isolation_after{};
  bool is_all = false;           // every change, not only those that one screen has room for
  std::string arguments{};       // of this command, for pasting
  std::string view_arguments{};  // of `cie view` of what is after; empty of a report
};

// For people: first how many callbacks became worse and better, how the number of late instances and
// isolation changed, and what runs the records lack; what is gone, new or runs otherwise; then what
// changed, the worst first, and how many comparisons were undecided, and why. At most 23 lines, unless
// all is wanted.
void write_diff_text(std::ostream& out, const analysis::Comparison& comparison,
                     const DiffContext& context, const TextStyle& style);

// `cie.diff/1`: every callback and quantity, with the confidence intervals. Times in nanoseconds,
// null for what is not known.
void write_diff_json(std::ostream& out, const analysis::Comparison& comparison,
                     const DiffContext& context);

}  // namespace cie::viewer_export
