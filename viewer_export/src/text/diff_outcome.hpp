// What a comparison came to, and how sure it is.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <string>
#include <vector>

namespace cie::viewer_export {

// There is a regression, or certainly none.
bool is_decided(const analysis::Comparison& comparison);

// "Worse: 1 of 3 callbacks (1 slower); better: 1, beyond a tolerance of 5 %".
std::string outcome_words(const analysis::Comparison& comparison, double tolerance,
                          const TextStyle& style);

// "12 quantiles within the tolerance; 3 undecided: …"; empty where nothing was compared.
std::string tally_words(const std::vector<analysis::CallbackChange>& changes,
                        const TextStyle& style);

// "3 of 18 quantiles undecided."; empty where all is decided.
std::string undecided_words(const std::vector<analysis::CallbackChange>& changes,
                            const TextStyle& style);

}  // namespace cie::viewer_export
