// What a recorder tells its user while it works, on standard error.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace cie::record {

class Console {
 public:
  void warn(const std::string& text);
  // Whole lines, each with its end.
  void say(const std::string& text);
  // On a terminal: one line that is written anew every second.
  void show_progress(std::chrono::steady_clock::duration elapsed, std::size_t processes,
                     bool is_command);

 private:
  std::optional<std::int64_t> shown_seconds_;  // in the line of progress; empty: there is none
};

}  // namespace cie::record
