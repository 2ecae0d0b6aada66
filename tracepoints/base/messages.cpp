#include "messages.hpp"

#include <cie/tracepoints/text_columns.hpp>
#include <cie/tracepoints/utf8.hpp>

#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

namespace cie {

void tell_plainly(std::string_view text) {
  const auto line = printable(text);
  const bool is_terminal = ::isatty(STDERR_FILENO) == 1;
  fmt::print(stderr, "{}",
             is_terminal ? filled(line, terminal_columns(STDERR_FILENO)) : line + '\n');
}

void tell(std::string_view text, std::string_view program) {
  tell_plainly(fmt::format("{}: {}", program, text));
}

void tell_wrong_usage(std::string_view what, std::string_view command) {
  tell(what, command.substr(0, command.find(' ')));
  tell_plainly(fmt::format("Try: {} --help", command));
}

}  // namespace cie
