// What programs say on standard error: printable whatever they quote, and on a terminal as wide as it is.
#pragma once

#include <cstddef>
#include <string_view>

namespace cie {

// The text as a line, or on a terminal as many as it takes.
void tell_plainly(std::string_view text);
// The same, which begins with the program's name: "cie: text".
void tell(std::string_view text, std::string_view program = "cie");

// How many lines were told on a terminal so far.
std::size_t told_lines() noexcept;

// Of a command line that cannot be followed: what is wrong, and "Try: cie record --help" where `command` is
// "cie record".
void tell_wrong_usage(std::string_view what, std::string_view command);

}  // namespace cie
