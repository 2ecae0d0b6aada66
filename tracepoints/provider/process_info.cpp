#include "process_info.hpp"

#include "base/machine.hpp"

#include <sys/stat.h>
#include <unistd.h>

namespace cie::trace {

ProcessInfo read_process_info() {
  ProcessInfo info;
  info.host = host_name();
  info.boot_id = boot_id();
  info.pid = static_cast<std::uint32_t>(getpid());
  struct stat status {};
  if (stat("/proc/self/ns/pid", &status) == 0) {
    info.pid_ns = status.st_ino;
  }
  info.process_start_ns = start_ns("self").value_or(-1);
  info.online_cpus = static_cast<std::uint32_t>(sysconf(_SC_NPROCESSORS_ONLN));
  return info;
}

}  // namespace cie::trace
