// What manifests say was recorded, held against what was seen of it.
#pragma once

#include <cie/analysis/report.hpp>

#include "facts.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

enum class PartKind : std::uint8_t { process, chunk, kernel };
std::string_view label(PartKind kind) noexcept;  // "process", …

// Something of which nothing was seen.
struct UnseenPart {
  PartKind kind{};
  std::string note;  // names it
};
std::vector<UnseenPart> unseen_parts(const Model& model);

// Why events of user space may be missing that were recorded; empty: nothing says so.
std::optional<std::string> missing_user_part(const Model& model);

// A recording whose recorder had problems, or did not end: how much of what applications emitted it did not
// write, it does not know.
struct RecorderFailure {
  const Recording* recording = nullptr;
  std::vector<std::string> problems;  // what it says itself, each once; at least one
};
std::vector<RecorderFailure> recorder_failures(const Model& model);
// "cie record says: the disk was full (run1)".
std::string in_words(const RecorderFailure& failure, const std::string& problem);

// Its manifest names every process that was recorded there; one that is not finished has none.
bool names_all_processes(const Recording& recording) noexcept;

// The process may be one that was recorded there.
bool may_be_of(const Model& model, const Recording& recording, const ProcessFacts& process);

// What a recorder saw of its clock: see ProcessFacts.
std::int64_t recorded_offset_ns(const Model& model, const ProcessFacts& process);

// The same of all events of the kernel.
std::optional<std::string> missing_kernel_part(const Model& model);

// Those that a file lies in.
std::vector<const Recording*> recordings_around(std::span<const Recording> recordings,
                                                const std::string& file);

// What recordings say of themselves, the chunks of one taken together.
std::vector<RecordingReport> recording_reports(const Model& model);

// Chunks before the first one that is here were recorded.
bool begins_late(const RecordingReport& recording) noexcept;

}  // namespace cie::analysis
