#include <cie/analysis/recording.hpp>
#include <cie/tracepoints/sha256.hpp>

#include "base/paths.hpp"
#include "ctf/metadata/types.hpp"
#include "discovery.hpp"
#include "missing_streams.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>

namespace cie::analysis {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxRecordings = 100'000;

bool has_part(const fs::path& path, const char* part) {
  return std::ranges::any_of(path.parent_path(), [part](const fs::path& p) { return p == part; });
}

// Why the file is not the one that was recorded; empty: it is.
std::string difference(const fs::path& file, const RecordedFile& recorded,
                       bool is_content_checked) {
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) return "cannot be read: " + error.message();
  if (size != recorded.size) {
    return "has " + std::to_string(size) + " bytes, and had " + std::to_string(recorded.size) +
           " when it was recorded";
  }
  if (!is_content_checked) return {};
  try {
    if (sha256_file(file) == recorded.sha256) return {};
  } catch (const std::exception& unreadable) {
    return unreadable.what();
  }
  return "has another content than when it was recorded (SHA-256)";
}

std::optional<FileDoubt> doubt_of(const fs::path& directory, const RecordedFile& recorded,
                                  bool is_content_checked) {
  FileDoubt doubt{.kind = FileDoubtKind::changed_file,
                  .note = recorded.path + ' ',
                  .costs_user_events = !has_part(recorded.path, kKernelDirectory) &&
                                       !has_part(recorded.path, kIndexDirectory)};
  std::error_code error;
  const auto file = fs::canonical(directory / recorded.path, error);
  if (error) {
    const bool is_missing =
        error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
    doubt.kind = FileDoubtKind::missing_file;
    doubt.note += is_missing ? "is missing" : "cannot be read: " + error.message();
    return doubt;
  }
  if (!is_below(file, directory)) {
    doubt.note += "is a link that leads out of the recording";
    return doubt;
  }
  if (!fs::is_regular_file(file, error)) {
    doubt.note += "is no file any more";
    return doubt;
  }
  const auto what = difference(file, recorded, is_content_checked);
  if (what.empty()) return std::nullopt;
  doubt.note += what;
  return doubt;
}

// A file that holds something and is not about others.
bool has_streams(const fs::path& directory) {
  std::error_code error;
  fs::recursive_directory_iterator entry(directory, error);
  if (error) return false;
  for (const fs::recursive_directory_iterator end; entry != end && !error; entry.increment(error)) {
    if (entry.depth() >= kMaxDepth) entry.disable_recursion_pending();
    std::error_code ignored;
    const auto& path = entry->path();
    const bool is_stream = path.filename() != kManifestName && path.filename() != kMetadataName &&
                           path.parent_path().filename() != kIndexDirectory &&
                           entry->is_regular_file(ignored) && entry->file_size(ignored) > 0;
    if (is_stream) return true;
  }
  return false;
}

std::optional<Recording> recording_at(const fs::path& named, bool is_content_checked) {
  Recording recording{.name = named.string()};
  std::error_code ignored;
  const auto directory = fs::canonical(named, ignored);
  try {
    recording.manifest = load_recording_manifest(directory);
    if (!recording.manifest) return std::nullopt;
  } catch (const std::exception& error) {
    recording.doubts.push_back({.kind = FileDoubtKind::manifest,
                                .note = std::string(kManifestName) +
                                        " says nothing that can be relied on: " + error.what()});
    return recording;
  }
  bool is_divided = false;
  for (const auto& file : recording.manifest->files) {
    if (auto doubt = doubt_of(directory, file, is_content_checked))
      recording.doubts.push_back(*std::move(doubt));
    const fs::path path(file.path);
    if (path.filename() != kManifestName) continue;
    is_divided = true;
    if (!has_streams(directory / path.parent_path()))
      recording.missing_chunks.push_back(path.parent_path().string());
  }
  // Chunks have their parts of them, and tell of those themselves.
  const auto& manifest = *recording.manifest;
  const bool has_kernel_events = manifest.has_kernel_events && manifest.kernel.events != 0;
  recording.is_kernel_missing =
      has_kernel_events && !is_divided && !has_streams(directory / kKernelDirectory);
  return recording;
}

// Of traces that no manifest describes only what their directories show is known.
void add_traces(std::span<const fs::path> directories, std::vector<Recording>& recordings) {
  auto missing = missing_streams(directories);
  for (std::size_t i = 0; i < directories.size(); ++i) {
    if (missing[i].empty()) continue;
    auto& trace = recordings.emplace_back(Recording{.name = directories[i].string()});
    for (auto& line : missing[i]) {
      trace.doubts.push_back({.kind = FileDoubtKind::missing_file,
                              .note = std::move(line),
                              .costs_user_events = true});
    }
  }
}

// Directories with such a file, in order of their names. What cannot be listed is told where traces are looked for.
std::vector<fs::path> with_file(std::span<const fs::path> directories, std::string_view name) {
  std::vector<fs::path> found;
  for (const auto& directory : directories) {
    std::error_code ignored;
    if (fs::exists(fs::symlink_status(directory / name, ignored))) found.push_back(directory);
    if (found.size() > kMaxRecordings) break;
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace

std::string_view label(FileDoubtKind kind) noexcept {
  switch (kind) {
    case FileDoubtKind::missing_file:
      return "missing_file";
    case FileDoubtKind::changed_file:
      return "changed_file";
    case FileDoubtKind::manifest:
      break;
  }
  return "manifest";
}

std::vector<Recording> find_recordings(std::span<const fs::path> traces, bool is_content_checked) {
  std::vector<Recording> recordings;
  std::vector<Recording> unfinished;
  std::vector<fs::path> undescribed;
  std::set<fs::path> known;  // traces may be named twice
  const auto is_new = [&known](const fs::path& directory) {
    std::error_code error;
    return known.insert(fs::canonical(directory, error)).second && !error;
  };
  for (const auto& trace : traces) {
    const auto directories = directories_in(trace).found;
    const auto described = with_file(directories, kManifestName);
    for (const auto& directory : described) {
      if (!is_new(directory)) continue;
      auto recording = recording_at(directory, is_content_checked);
      if (recording) recordings.push_back(*std::move(recording));
    }
    for (const auto& directory : with_file(directories, kRecordingClaimName)) {
      if (!std::ranges::binary_search(described, directory) && is_new(directory))
        unfinished.push_back({.name = directory.string(), .is_unfinished = true});
    }
    const auto is_described = [&described](const fs::path& directory) {
      return std::ranges::any_of(described, [&directory](const fs::path& recording) {
        return recording == directory || is_below(directory, recording);
      });
    };
    for (const auto& directory : with_file(directories, kMetadataName)) {
      if (!is_described(directory) && is_new(directory)) undescribed.push_back(directory);
    }
  }
  std::ranges::move(unfinished, std::back_inserter(recordings));
  add_traces(undescribed, recordings);
  return recordings;
}

bool is_file_of_recording(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  constexpr std::size_t kManifestBegin = 256;
  std::array<char, kManifestBegin> buffer{};
  std::ifstream file(path, std::ios::binary);
  file.read(buffer.data(), buffer.size());
  const std::string_view begin(buffer.data(), static_cast<std::size_t>(file.gcount()));
  std::uint32_t magic = 0;
  if (begin.size() >= sizeof magic) std::memcpy(&magic, begin.data(), sizeof magic);
  constexpr std::uint32_t kIndexMagic = 0xC1F1DCC1;  // LTTng's, big-endian
  const bool is_ctf = magic == ctf::kPacketMagic || magic == __builtin_bswap32(ctf::kPacketMagic) ||
                      magic == ctf::kMetadataMagic ||
                      magic == __builtin_bswap32(ctf::kMetadataMagic) ||
                      magic == __builtin_bswap32(kIndexMagic) || begin.starts_with("/* CTF ") ||
                      begin.starts_with("\x1e{");
  return is_ctf || begin.find("\"cie.recording/") != std::string_view::npos;
}

}  // namespace cie::analysis
