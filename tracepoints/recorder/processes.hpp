// What /proc tells of other processes, which may end at any time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <sys/types.h>

namespace cie::record {

// The name of its program, at most 15 bytes; empty if it is gone.
std::string process_name(pid_t pid);

// The parent of a process, 0 if it is gone.
pid_t parent_of(pid_t pid);

// When it was created, in clock ticks since the machine booted; empty if it is gone. With the pid
// it tells a process from a later one of the same pid.
std::optional<std::uint64_t> start_ticks(pid_t pid);

// Itself counts as a descendant.
bool descends_from(pid_t pid, pid_t ancestor);

}  // namespace cie::record
