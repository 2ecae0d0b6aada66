// Text on a terminal, whose columns are neither bytes nor code points.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cie {

// Columns that printable text takes on a terminal.
std::size_t display_width(std::string_view text) noexcept;

// The longest prefix that is at most `columns` wide.
std::string_view leading_columns(std::string_view text, std::size_t columns) noexcept;

// Breaks between words, and within those that are wider than `columns`.
std::vector<std::string> wrap(std::string_view text, std::size_t columns);

// How wide the terminal is that a descriptor leads to; 80 where it does not say.
std::size_t terminal_columns(int descriptor) noexcept;

// The text on lines at most `columns` wide, each with its end; those after the first begin `indent`
// further in than it does. Words that are wider, as paths are, stay whole.
std::string filled(std::string_view text, std::size_t columns, std::size_t indent = 0);

}  // namespace cie
