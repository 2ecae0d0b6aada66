#include "system/console.hpp"

#include <cie/tracepoints/text_columns.hpp>
#include <cie/tracepoints/utf8.hpp>

#include <cstdio>
#include <sstream>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

// A recording goes on when nobody can be told of it: fmt::print() would throw.
void print(const std::string& text) noexcept { std::fputs(text.c_str(), stderr); }

// Each line printable, whatever it quotes, and on a terminal as wide as it is; commands are for
// pasting, and stay whole.
std::string laid_out(const std::string& text, bool is_terminal) {
  constexpr std::size_t kIndent = 2;
  std::istringstream lines(text);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    line = printable(line);
    const bool is_command =
        line.find(": cie ") != std::string::npos || line.starts_with("      cie ");
    result += is_terminal && !is_command ? filled(line, terminal_columns(STDERR_FILENO), kIndent)
                                         : line + '\n';
  }
  return result;
}

}  // namespace

void Console::warn(const std::string& text) { say("cie record: warning: " + text + '\n'); }

void Console::say(const std::string& text) {
  const auto lines = laid_out(text, isatty(STDERR_FILENO) == 1);
  print(shown_seconds_ ? '\n' + lines : lines);
}

void Console::show_progress(std::chrono::steady_clock::duration elapsed, std::size_t processes,
                            bool is_command) {
  if (isatty(STDERR_FILENO) == 0) {
    return;
  }
  const std::int64_t seconds = std::chrono::duration_cast<std::chrono::seconds>(elapsed).count();
  if (seconds != shown_seconds_) {
    shown_seconds_ = seconds;
    print(fmt::format("\rrecording {} s, traced processes: {}{}", seconds, processes,
                      is_command ? "" : ", Ctrl-C ends it"));
  }
}

}  // namespace cie::record
