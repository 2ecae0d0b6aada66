#include "recording_words.hpp"

#include "text_layout.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace cie::viewer_export {

std::vector<std::string> sentences_of(const analysis::RecordingReport& recording) {
  std::vector<std::string> sentences;
  if (recording.exit && !recording.command.empty()) {
    sentences.push_back(printable(recording.command.front()) + ' ' + describe(*recording.exit));
  }
  if (recording.first_chunk && *recording.first_chunk > 1) {
    sentences.push_back(
        fmt::format("begins with chunk {}: those before are gone", *recording.first_chunk));
  }
  return sentences;
}

std::optional<bool> is_complete(const analysis::Report& report) {
  if (report.trace.complete) return true;
  const bool is_known =
      std::ranges::any_of(
          report.defects,
          [](const auto& defect) { return defect.severity != analysis::Severity::info; }) ||
      std::ranges::any_of(report.processes, [](const auto& process) { return !process.complete; });
  return is_known ? std::optional(false) : std::nullopt;
}

}  // namespace cie::viewer_export
