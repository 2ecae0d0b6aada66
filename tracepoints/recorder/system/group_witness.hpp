// Whether a signal went to this process alone, or to its whole process group.
#pragma once

#include "base/file_descriptor.hpp"

#include <optional>

#include <sys/types.h>

namespace cie::record {

// A small process of the same group, which receives what the group is sent: the kernel does not say
// whom else it gave a signal. It ends with this one. Create it while the signals that it is asked
// for are blocked, and before any thread.
class GroupWitness {
 public:
  // Throws RecordError.
  GroupWitness();
  ~GroupWitness();
  GroupWitness(const GroupWitness&) = delete;
  GroupWitness& operator=(const GroupWitness&) = delete;

  // Whether the group was sent this signal since it was asked last. Empty: it does not say.
  std::optional<bool> has_seen(int signal) const noexcept;

 private:
  FileDescriptor connection_;
  pid_t pid_ = -1;
};

}  // namespace cie::record
