// The kernel's tracing file system and, in it, ring buffers that are this recording's alone.
#pragma once

#include "base/file_descriptor.hpp"
#include "system/error.hpp"

#include <string>
#include <vector>

namespace cie::record {

// Paths are relative to tracefs. Functions throw RecordError, naming file and cause.
class Tracefs {
 public:
  // Uses the mounted one if this user may create instances there; else a mount that belongs to no
  // mount namespace, so that nobody else sees it and it is gone with this object. Throws
  // KernelUnavailable.
  Tracefs();

  bool has(const std::string& path) const;
  std::string read(const std::string& path) const;
  void write(const std::string& path, const std::string& text) const;
  FileDescriptor open(const std::string& path, int flags) const;
  // Names in a directory; empty if it is not there.
  std::vector<std::string> list(const std::string& path) const;
  void make_directory(const std::string& path) const;
  bool remove_directory(const std::string& path) const noexcept;

 private:
  FileDescriptor root_;
};

// Buffers, events and clock of their own: what others trace is neither seen nor disturbed.
class TraceInstance {
 public:
  // Throws KernelUnavailable. Removes what killed recorders left.
  explicit TraceInstance(const Tracefs& tracefs);
  // Everything opened in it must be closed by then.
  ~TraceInstance();
  TraceInstance(const TraceInstance&) = delete;
  TraceInstance& operator=(const TraceInstance&) = delete;

  std::string path(const std::string& file) const { return path_ + '/' + file; }
  void write(const std::string& file, const std::string& text) const;

 private:
  const Tracefs& tracefs_;
  std::string path_;
};

// Removes the instances of recorders that run no more. Those of another pid namespace are left
// alone: whether they run cannot be seen from here. Returns how many.
int remove_abandoned_instances(const Tracefs& tracefs);

}  // namespace cie::record
