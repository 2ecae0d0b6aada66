// What became worse or better of callbacks, and by how much.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/text_style.hpp>

#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace cie::viewer_export {

// Counts that differ, by no more than chance explains.
bool may_be_chance(const analysis::CallbackChange& change, analysis::Count count);

struct ChangeRow {
  int group = 0;
  double rank = 0;  // within the group, ascending
  std::string callback;
  std::vector<TextCell> cells;  // the others
};

// A row for each quantile and count that is certain to have changed, for counts that differ, and for
// late instances and the longest response beside them. First what was late most often and the other
// counts that are worse, then quantiles that are worse, by growth, and what is better.
std::vector<ChangeRow> change_rows(const std::vector<analysis::CallbackChange>& changes,
                                   const CallbackNames& names);

// So many of the rows; a callback's name stands on the first of its rows that follow each other.
// Names are whole where `is_all`, ids always.
std::string change_table(const std::vector<ChangeRow>& rows, std::size_t shown, bool is_all,
                         const TextStyle& style);

}  // namespace cie::viewer_export
