#include "process_info.hpp"

#include "base/machine.hpp"

#include <cstdint>

#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

namespace cie::trace {
namespace {

// By it readers tell that two runs are of one process. It is read once: readings differ by what passes
// between looks at two clocks, and by every suspend since.
std::int64_t own_start_ns() {
  static pid_t of = 0;
  static std::int64_t start = -1;
  if (const pid_t self = getpid(); of != self) {  // the first time, and in a child of fork()
    of = self;
    start = start_ns("self").value_or(-1);
  }
  return start;
}

}  // namespace

ProcessInfo read_process_info() {
  ProcessInfo info;
  info.host = host_name();
  info.boot_id = boot_id();
  info.pid = static_cast<std::uint32_t>(getpid());
  struct stat status {};
  if (stat("/proc/self/ns/pid", &status) == 0) {
    info.pid_ns = status.st_ino;
  }
  info.process_start_ns = own_start_ns();
  info.online_cpus = static_cast<std::uint32_t>(sysconf(_SC_NPROCESSORS_ONLN));
  info.monotonic_offset_ns = monotonic_offset_ns("self").value_or(0);
  return info;
}

}  // namespace cie::trace
