// What /proc tells of other processes, which may end at any time.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace cie::record {

// The name of its program, at most 15 bytes; empty if it is gone.
std::string process_name(pid_t pid);

// Whether all of its threads wait for something: none has work that it knows of. Of a process that is
// gone, too.
bool is_asleep(pid_t pid);

// The parent of a process, 0 if it is gone.
pid_t parent_of(pid_t pid);

// When it was created, in clock ticks since the machine booted; empty if it is gone. With the pid
// it tells a process from a later one of the same pid.
std::optional<std::uint64_t> start_ticks(pid_t pid);

// By what its CLOCK_MONOTONIC is ahead of the machine's, in a time namespace; empty: it is not, or that is not
// known.
std::optional<std::int64_t> other_clock(pid_t pid);

// Tells a process from all others, over pid namespaces and reused pids.
struct ProcessIdentity {
  std::string pid_namespace;
  pid_t pid = 0;
  std::uint64_t start_ticks = 0;

  bool operator==(const ProcessIdentity&) const = default;
};

// Of a process that is gone, no process's.
ProcessIdentity identity_of(pid_t pid);
// "4026531836-1234-56789", and back; empty if it is no such text.
std::string to_text(const ProcessIdentity& identity);
std::optional<ProcessIdentity> parse_identity(std::string text);

// Whether it is still that process and runs; one that ended and that nobody waited for does not.
bool is_running(const ProcessIdentity& process);

// Those that it is the parent of.
std::vector<pid_t> children_of(pid_t pid);

// One of its arguments is this; false if it is gone.
bool has_argument(pid_t pid, std::string_view argument);

// Whether a process of this group runs; one that ended and that nobody waited for does not.
bool is_group_running(pid_t group);

// Sends SIGTERM to the process, waits so long for it and for the group that it leads, if it leads
// one, and kills what is left then.
void end_process(pid_t pid, std::chrono::milliseconds patience) noexcept;

// Itself counts as a descendant.
bool descends_from(pid_t pid, pid_t ancestor);

}  // namespace cie::record
