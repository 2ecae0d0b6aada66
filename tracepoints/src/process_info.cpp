#include "process_info.hpp"

#include <array>
#include <ctime>
#include <fstream>
#include <sstream>

#include <sys/stat.h>
#include <unistd.h>

namespace cie::trace {
namespace {

std::int64_t now_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// Field 22 of /proc/self/stat counts clock ticks since boot, suspend included (CLOCK_BOOTTIME).
std::int64_t process_start_ns() {
  std::ifstream file("/proc/self/stat");
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');  // the name before it may contain anything
  if (name_end == std::string::npos) {
    return -1;
  }
  std::istringstream fields(text.substr(name_end + 1));
  std::string skipped;
  for (int field = 3; field < 22; ++field) {
    fields >> skipped;
  }
  std::int64_t ticks = 0;
  if (!(fields >> ticks)) {
    return -1;
  }
  const std::int64_t since_boot = ticks * (1'000'000'000 / sysconf(_SC_CLK_TCK));
  return since_boot - (now_ns(CLOCK_BOOTTIME) - now_ns(CLOCK_MONOTONIC));
}

std::string first_line(const char* path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

}  // namespace

ProcessInfo read_process_info() {
  ProcessInfo info;
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) == 0) {
    info.host = host.data();
  }
  info.boot_id = first_line("/proc/sys/kernel/random/boot_id");
  info.pid = static_cast<std::uint32_t>(getpid());
  struct stat status {};
  if (stat("/proc/self/ns/pid", &status) == 0) {
    info.pid_ns = status.st_ino;
  }
  info.process_start_ns = process_start_ns();
  info.online_cpus = static_cast<std::uint32_t>(sysconf(_SC_NPROCESSORS_ONLN));
  return info;
}

}  // namespace cie::trace
