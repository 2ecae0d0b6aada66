// Deadlines kept and missed, before and after.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/diff_writers.hpp>

#include "words/callback_names.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace cie::viewer_export {

// Callbacks with the same deadline on both sides, those first that were late most often, then the
// slowest. Borrowed from `changes`.
std::vector<const analysis::CallbackChange*> with_deadline(
    const std::vector<analysis::CallbackChange>& changes);

// "Late: 96 of 970 instances before, 0 of 968 after; 19 callbacks have a deadline".
std::string lateness_words(const std::vector<const analysis::CallbackChange*>& changes,
                           const TextStyle& style);

// Empty where each callback has the deadline that it had.
std::string other_deadlines(const std::vector<analysis::CallbackChange>& changes);

// Side by side, of at most so many callbacks; requires one.
std::string deadline_table(const std::vector<const analysis::CallbackChange*>& changes,
                           const DiffContext& context, const CallbackNames& names, std::size_t most,
                           const TextStyle& style);

}  // namespace cie::viewer_export
