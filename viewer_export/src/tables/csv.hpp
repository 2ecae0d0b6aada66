// Comma-separated values as RFC 4180 has them, with "\n" between rows.
#pragma once

#include <string>
#include <string_view>

namespace cie::viewer_export {

// Whether a spreadsheet would compute the text, or run what it names, instead of showing it: it
// begins with =, +, -, @, a tab or a carriage return.
bool is_formula(std::string_view text) noexcept;

// A name: what is_formula() gets a ' in front, as spreadsheets mark text. Quoted when it holds a
// comma, a quote or a line break. Invalid UTF-8 becomes U+FFFD. Numbers are no names: -5 is written
// as it is.
std::string csv_field(std::string_view text);

}  // namespace cie::viewer_export
