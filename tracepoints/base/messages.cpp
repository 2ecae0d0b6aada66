#include "messages.hpp"

#include <cie/tracepoints/text_columns.hpp>
#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

namespace cie {

namespace {
std::atomic<std::size_t> lines_told{0};
}  // namespace

void tell_plainly(std::string_view text) {
  const auto line = printable(text);
  if (::isatty(STDERR_FILENO) != 1) {
    fmt::print(stderr, "{}\n", line);
    return;
  }
  const auto lines = filled(line, terminal_columns(STDERR_FILENO));
  lines_told += static_cast<std::size_t>(std::ranges::count(lines, '\n'));
  fmt::print(stderr, "{}", lines);
}

std::size_t told_lines() noexcept { return lines_told; }

void tell(std::string_view text, std::string_view program) {
  tell_plainly(fmt::format("{}: {}", program, text));
}

void tell_wrong_usage(std::string_view what, std::string_view command) {
  tell(what, command.substr(0, command.find(' ')));
  tell_plainly(fmt::format("Try: {} --help", command));
}

}  // namespace cie
