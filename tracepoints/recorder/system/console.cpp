#include "system/console.hpp"

#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

// A recording goes on when nobody can be told of it: fmt::print() would throw.
void print(const std::string& text) noexcept { std::fputs(text.c_str(), stderr); }

}  // namespace

void Console::warn(const std::string& text) { say("cie record: warning: " + text + '\n'); }

void Console::say(const std::string& text) { print(shown_seconds_ ? '\n' + text : text); }

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
