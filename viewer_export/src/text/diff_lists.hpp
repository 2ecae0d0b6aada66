// What a comparison tells besides times: what the records lack, and which callbacks are gone, new or
// run otherwise.
#pragma once

#include <cie/analysis/comparison.hpp>

#include "screen.hpp"
#include "words/callback_names.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace cie::viewer_export {

constexpr std::size_t kDiffLabel = 11;  // columns of what a fact is about

// Whether lists are as long as they are, or shortened for a screen.
enum class ListLength : bool { screen, whole };

// "  record     after lacks instances: damaged-packets x 2, seq-gaps x 325"; none for complete records.
Lines record_lines(const analysis::Comparison& comparison, ListLength length,
                   const TextStyle& style);

// "  deadlines  1 callback has another deadline than before: not compared"; none where each has the
// one that it had.
Lines other_deadlines(const std::vector<analysis::CallbackChange>& changes);

// "  releases   2 timers skipped periods: …", where the recordings tell other expiries of these.
Lines release_lines(const std::vector<analysis::CallbackChange>& changes, const TextStyle& style);

// "  is gone: plan timer 20 ms, ... 3 more", for each such thing that there is; on a screen a line.
Lines structural_changes(const std::vector<analysis::CallbackChange>& changes,
                         const CallbackNames& names, ListLength length, const TextStyle& style);

}  // namespace cie::viewer_export
