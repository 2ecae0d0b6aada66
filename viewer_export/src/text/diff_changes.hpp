// What became worse or better of callbacks, and by how much.
#pragma once

#include <cie/analysis/comparison.hpp>
#include <cie/viewer_export/text_style.hpp>

#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

inline bool is_certain(analysis::Change change) {
  return change == analysis::Change::worse || change == analysis::Change::better;
}

// Counts that differ, by no more than chance explains.
bool is_open(const std::optional<std::uint64_t>& before, const std::optional<std::uint64_t>& after,
             analysis::Change change);

// The same of how many were late, where both counts are known.
bool is_late_open(const analysis::CallbackChange& change);

// Something is, and nothing worse.
bool is_better(const analysis::CallbackChange& change);

// Ascending: the worst first, the best last.
double change_rank(const analysis::CallbackChange& change);

// "  worst      plan timer 20 ms: response time p99 399.4 us -> 4.360 ms, +991.7 %"; the last of it
// where there is room. The label is as wide as the screen's others (kDiffLabel).
std::string extreme_line(std::string_view label, const analysis::CallbackChange& callback,
                         analysis::Change kind, const CallbackNames& names, const TextStyle& style);

// A row for each certain change, and for counts that differ; the callback's name stands on its first.
using ChangeRow = std::vector<TextCell>;
void add_changes(std::vector<ChangeRow>& rows, const analysis::CallbackChange& change,
                 const CallbackNames& names);

// Where ranges have no room, they are left out.
std::string change_table(std::span<const ChangeRow> rows, const TextStyle& style);

// As many of the changes as that many lines have room for, and how many more there are.
std::string change_table(std::span<const ChangeRow> rows, std::size_t lines,
                         const TextStyle& style);

}  // namespace cie::viewer_export
