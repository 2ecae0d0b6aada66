// What a comparison tells besides times: what the records lack, and which callbacks are gone, new or
// run otherwise.
#pragma once

#include <cie/analysis/comparison.hpp>

#include "screen.hpp"
#include "words/callback_names.hpp"

#include <string>
#include <vector>

namespace cie::viewer_export {

// "  record     after lacks runs: damaged-packets x 2, seq-gaps x 325"; none for complete records.
Lines record_lines(const analysis::Comparison& comparison, const TextStyle& style);

// "  is gone: plan timer 20 ms", a line for each such thing that there is.
Lines structural_changes(const std::vector<analysis::CallbackChange>& changes,
                         const CallbackNames& names, const TextStyle& style);

}  // namespace cie::viewer_export
