// The directory that one recorder, and no other, writes a recording into.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include <filesystem>

#include <sys/types.h>

namespace cie::record {

class DirectoryClaim {
 public:
  // In the directory while it is held; no part of the recording.
  static constexpr const char* kFileName = kRecordingClaimName;

  // Creates the directory, or takes one that is there and empty. Of several recorders that want it
  // at once exactly one gets it. Throws UsageError for the others and where something is in it,
  // RecordError where it cannot be written.
  explicit DirectoryClaim(const std::filesystem::path& directory);
  ~DirectoryClaim() { release(); }
  DirectoryClaim(const DirectoryClaim&) = delete;
  DirectoryClaim& operator=(const DirectoryClaim&) = delete;

  // Whether the directory is still where it was: false if it was removed, or renamed.
  bool is_in_place() const noexcept;
  // When the recording is there, with its manifest: they keep others out.
  void release() noexcept;
  // When there is none: a directory that was created here is removed with all that is in it.
  void withdraw() noexcept;

 private:
  // Another directory may have its name later.
  struct Identity {
    dev_t device = 0;
    ino_t inode = 0;
    bool operator==(const Identity&) const = default;
  };

  std::filesystem::path directory_;
  Identity identity_;
  bool is_created_ = false;
  bool is_held_ = false;
};

}  // namespace cie::record
