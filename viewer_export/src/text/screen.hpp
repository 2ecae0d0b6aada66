// What screens of text are made of.
#pragma once

#include <cie/viewer_export/text_style.hpp>

#include "words/text_layout.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// Beside its rows a table has a blank line above, two of titles, and one of what is left out.
constexpr std::size_t kLinesAroundRows = 4;

using Lines = std::vector<std::string>;

void append(Lines& lines, Lines more);

// Wrapped, at most `most` lines; those after the first begin as far in as the text of the first.
Lines paragraph(std::string_view begin, std::string_view text, std::size_t most,
                const TextStyle& style);

// The widest table that is whole on the screen: `table` makes one with the `extras`, columns that there
// may be room for, the most useful first. They become those that it has.
template <typename Extra, typename Table>
TextTable with_room_for(std::vector<Extra>& extras, const Table& table, const TextStyle& style) {
  auto shown = table();
  while (!extras.empty() && shown.natural_width() > style.columns) {
    extras.pop_back();
    shown = table();
  }
  return shown;
}

// A table below a blank line.
Lines table_lines(const TextTable& table, const TextStyle& style);

// "evidence: cie verify run1 --all    look: cie view run1": side by side where there is room. What
// is wider than a line is broken as a shell reads on, between arguments.
Lines commands_to_paste(const std::vector<std::pair<std::string_view, std::string>>& commands,
                        const TextStyle& style);

}  // namespace cie::viewer_export
