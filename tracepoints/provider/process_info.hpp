// Who this process is, for `run_begin`.
#pragma once

#include <cstdint>
#include <string>

namespace cie::trace {

struct ProcessInfo {
  std::string host;
  std::string boot_id;
  std::uint32_t pid = 0;     // in its own pid namespace …
  std::uint64_t pid_ns = 0;  // … whose inode this is; 0 unknown
  // CLOCK_MONOTONIC, with the resolution of the kernel's clock tick (10 ms); -1 unknown.
  std::int64_t process_start_ns = -1;
  std::uint32_t online_cpus = 0;
  std::int64_t monotonic_offset_ns = 0;  // see base/machine.hpp; 0 also where it is not known
};

// Reads /proc. What cannot be read stays at its default. Not thread-safe. A process's calls agree about
// when it began.
ProcessInfo read_process_info();

}  // namespace cie::trace
