// What recordings say of themselves in their manifests, and which of their files disagree.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

enum class FileDoubtKind : std::uint8_t { missing_file, changed_file, manifest };
std::string_view label(FileDoubtKind kind) noexcept;  // "missing_file", …

// A file is not what the manifest says, or not there though its trace's other files show that it was, or the manifest
// itself is of no use.
struct FileDoubt {
  FileDoubtKind kind{};
  std::string note;  // names the file and says what is wrong
  // Events of user space may have been in it. Those of the kernel can be done without, and nothing
  // is read from indices.
  bool costs_user_events = false;
};

struct Recording {
  std::string name;                             // of its directory, as the user named it
  std::optional<RecordingManifest> manifest{};  // empty: it has none that can be used
  std::vector<FileDoubt> doubts{};
  std::vector<std::string> missing_chunks{};  // that it names: nothing is where they were
  bool is_kernel_missing = false;             // it names kernel events: nothing is where they were
  bool is_unfinished = false;                 // it is being recorded, or its recorder was killed
};

// The recordings at and below what the user named, each with a manifest, in order of their names: a
// recording in chunks and each of its chunks. Behind them, those without a manifest: that a recorder
// did not finish, and traces of which files are missing. Files are held against the manifest by their
// sizes; also by their SHA-256 if `is_content_checked`, which reads all of them. What is wrong is a
// doubt, never an exception.
std::vector<Recording> find_recordings(std::span<const std::filesystem::path> traces,
                                       bool is_content_checked);

// Whether it is a stream of CTF or its index, metadata, or a manifest, by what it begins with. What
// cannot be read is none.
bool is_file_of_recording(const std::filesystem::path& file);

}  // namespace cie::analysis
