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

}  // namespace cie
