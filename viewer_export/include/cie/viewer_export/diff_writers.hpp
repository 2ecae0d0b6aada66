// A comparison in the formats of `cie diff`. Pure functions, as those of report_writers.hpp.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <ostream>
#include <string>
#include <vector>

namespace cie::viewer_export {

struct DiffContext {
  std::string before;  // what is compared, as the user named it
  std::string after;
  double tolerance = 0;
};

// For people: the outcome first, then every change that is certain and what is no longer there,
// then how many comparisons were undecided for want of instances.
void write_diff_text(std::ostream& out, const std::vector<analysis::CallbackChange>& changes,
                     const DiffContext& context, const TextStyle& style);

// `cie.diff/1`: every callback and quantity, with the confidence intervals. Times in nanoseconds,
// null for what is not known.
void write_diff_json(std::ostream& out, const std::vector<analysis::CallbackChange>& changes,
                     const DiffContext& context);

}  // namespace cie::viewer_export
