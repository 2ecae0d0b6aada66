// What a comparison came to, and how sure it is.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <string>
#include <vector>

namespace cie::viewer_export {

// "Worse: 1 of 3 callbacks (1 slower); better: 1, beyond a tolerance of 5 %".
std::string outcome_words(const analysis::Comparison& comparison, double tolerance,
                          const TextStyle& style);

// "Late: 96 of 970 instances before, 0 of 968 after; 19 callbacks have a deadline"; empty where none
// has the same on both sides.
std::string lateness_words(const std::vector<analysis::CallbackChange>& changes,
                           const TextStyle& style);

// "3 of 18 quantiles undecided: too few instances (3)."; empty where all is decided.
std::string undecided_words(const std::vector<analysis::CallbackChange>& changes,
                            const TextStyle& style);

}  // namespace cie::viewer_export
