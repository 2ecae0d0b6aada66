// The directory that one recorder, and no other, writes a recording into.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "base/directory.hpp"

#include <filesystem>

namespace cie::record {

// Opens a directory that is to be written into. Throws UsageError with the reason if others could
// put something in the way of what is written: it belongs to another user, everybody may write to
// it, or a link of another user leads to it. RecordError if it is not there.
Directory open_own(const std::filesystem::path& directory);
// The same; makes it, and those above it, unless they are there.
Directory make_own(const std::filesystem::path& directory);

class DirectoryClaim {
 public:
  // In the directory while it is held; no part of the recording.
  static constexpr const char* kFileName = kRecordingClaimName;

  // Creates the directory, or takes one that is there and empty. Of several recorders that want it
  // at once exactly one gets it. Throws UsageError for the others, where something is in it and
  // where it is not this user's alone, RecordError where it cannot be written.
  explicit DirectoryClaim(const std::filesystem::path& directory);
  ~DirectoryClaim() { release(); }
  DirectoryClaim(const DirectoryClaim&) = delete;
  DirectoryClaim& operator=(const DirectoryClaim&) = delete;

  // As it was claimed, whatever its path leads to.
  const Directory& directory() const noexcept { return directory_; }
  // Whether the directory is still where it was: false if it was removed, or renamed.
  bool is_in_place() const noexcept;
  // When the recording is there, with its manifest: they keep others out.
  void release() noexcept;
  // When there is none: a directory that was created here is removed with all that is in it.
  void withdraw() noexcept;

 private:
  Directory directory_;
  bool is_held_ = false;
};

}  // namespace cie::record
