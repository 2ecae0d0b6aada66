// A directory for sockets and the like of the daemons that this process starts.
#pragma once

#include "base/file_descriptor.hpp"

#include <filesystem>
#include <string>

#include <sys/types.h>

namespace cie::record {

// Removed with all that is in it by the destructor; that of a process that was killed by the next
// one that makes such a directory, with the daemon that was left behind. A lock in it, which ends
// with the process however that ends, tells whose is whose.
class TemporaryDirectory {
 public:
  // PREFIX and six characters more, in `where`. Sweeps what killed ones left there. Throws
  // RecordError.
  TemporaryDirectory(const std::filesystem::path& where, const std::string& prefix);
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  // The daemon that lives in it, and leads a group. Throws RecordError.
  void note_daemon(pid_t pid) const;

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  FileDescriptor lock_;
};

}  // namespace cie::record
