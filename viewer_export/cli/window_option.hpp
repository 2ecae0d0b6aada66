// `--window FROM..TO`: a part of the recording.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "command_line.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::cli {

// One end of a window as it is written: "" (that of the recording), "983005016596" (nanoseconds of
// CLOCK_MONOTONIC), "+1.5s" (after the recording's begin) or "-200ms" (before its end).
struct WindowBound {
  enum class Origin : std::uint8_t { recording, clock, begin, end };
  Origin origin = Origin::recording;
  analysis::Duration offset{};  // from that; of the clock: since its origin
  friend bool operator==(const WindowBound&, const WindowBound&) = default;
};

// Throws UsageError, which names the forms there are.
WindowBound parse_window_bound(std::string_view text);

class WindowOption {
 public:
  // Adds it to `line`, which reads into this object when it parses.
  explicit WindowOption(CommandLine& line);
  WindowOption(const WindowOption&) = delete;
  WindowOption& operator=(const WindowOption&) = delete;

  // After parsing: sets options.window. Relative ends need to know when the recording begins and
  // ends, for which it is read. Throws UsageError and UnreadableTrace.
  void resolve(const std::vector<std::filesystem::path>& traces,
               analysis::AnalysisOptions& options) const;
  // As it was written; empty if it was not given.
  const std::string& text() const noexcept { return text_; }
  // Throws UsageError if the window has nothing in common with what was read; it says when the
  // recording is, for which it is read again. `options` as it was resolved.
  void check(const analysis::Report& report, const std::vector<std::filesystem::path>& traces,
             const analysis::AnalysisOptions& options) const;
  // The same of a reading that found no event in it.
  void check_empty(const std::vector<std::filesystem::path>& traces,
                   const analysis::AnalysisOptions& options) const;

 private:
  [[noreturn]] void refuse_outside(const std::optional<analysis::TimeWindow>& recorded) const;

  std::string text_;
};

}  // namespace cie::cli
