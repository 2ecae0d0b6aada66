#include "system/processes.hpp"

#include "base/machine.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

std::string in_proc(pid_t pid) { return std::to_string(pid); }

// The letter that /proc has for what a process or thread does ("42", "42/task/43"); empty if it is gone.
std::optional<char> state_of(const std::string& process) {
  const std::string stat = first_line("/proc/" + process + "/stat");
  const std::size_t name_end = stat.rfind(") ");  // the name may hold anything
  if (name_end == std::string::npos || name_end + 2 >= stat.size()) return std::nullopt;
  return stat[name_end + 2];
}

std::vector<pid_t> all_processes() {
  std::vector<pid_t> all;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    const auto pid = static_cast<pid_t>(std::strtol(name.c_str(), nullptr, 10));
    if (pid > 0) all.push_back(pid);
  }
  return all;
}

}  // namespace

std::string process_name(pid_t pid) { return first_line("/proc/" + in_proc(pid) + "/comm"); }

bool is_asleep(pid_t pid) {
  std::error_code error;
  const std::string tasks = in_proc(pid) + "/task/";
  std::filesystem::directory_iterator threads("/proc/" + tasks, error);
  for (const std::filesystem::directory_iterator end; !error && threads != end;
       threads.increment(error)) {
    if (state_of(tasks + threads->path().filename().string()).value_or('S') != 'S') return false;
  }
  return true;
}

pid_t parent_of(pid_t pid) { return static_cast<pid_t>(stat_field(in_proc(pid), 4).value_or(0)); }

std::optional<std::uint64_t> start_ticks(pid_t pid) { return stat_field(in_proc(pid), 22); }

std::optional<std::int64_t> other_clock(pid_t pid) {
  const auto offset = monotonic_offset_ns(std::to_string(pid));
  return offset.value_or(0) != 0 ? offset : std::nullopt;
}

ProcessIdentity identity_of(pid_t pid) {
  std::error_code error;
  std::string space = std::filesystem::read_symlink("/proc/self/ns/pid", error).string();
  std::erase_if(space, [](char c) { return c < '0' || c > '9'; });
  return {.pid_namespace = space, .pid = pid, .start_ticks = start_ticks(pid).value_or(0)};
}

std::string to_text(const ProcessIdentity& identity) {
  return fmt::format("{}-{}-{}", identity.pid_namespace, identity.pid, identity.start_ticks);
}

std::optional<ProcessIdentity> parse_identity(std::string text) {
  std::ranges::replace(text, '-', ' ');
  std::istringstream parts(text);
  ProcessIdentity identity;
  const bool is_one =
      static_cast<bool>(parts >> identity.pid_namespace >> identity.pid >> identity.start_ticks);
  return is_one && identity.pid > 0 ? std::optional(identity) : std::nullopt;
}

bool is_running(const ProcessIdentity& process) {
  return identity_of(process.pid) == process && state_of(in_proc(process.pid)).value_or('Z') != 'Z';
}

std::vector<pid_t> children_of(pid_t pid) {
  auto children = all_processes();
  std::erase_if(children, [pid](pid_t child) { return parent_of(child) != pid; });
  return children;
}

bool has_argument(pid_t pid, std::string_view argument) {
  std::ifstream file("/proc/" + in_proc(pid) + "/cmdline");
  std::string each;
  while (std::getline(file, each, '\0')) {
    if (each == argument) return true;
  }
  return false;
}

void end_process(pid_t pid, std::chrono::milliseconds patience) noexcept {
  using std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kPoll{20};
  const bool is_leader = getpgid(pid) == pid;
  kill(pid, SIGTERM);
  const auto is_running = [=] {
    return is_leader ? is_group_running(pid) : kill(pid, 0) == 0 || errno == EPERM;
  };
  const auto deadline = steady_clock::now() + patience;
  while (is_running()) {
    if (steady_clock::now() > deadline) {
      kill(is_leader ? -pid : pid, SIGKILL);
      return;
    }
    std::this_thread::sleep_for(kPoll);
  }
}

bool is_group_running(pid_t group) {
  return std::ranges::any_of(all_processes(), [group](pid_t pid) {
    return stat_field(in_proc(pid), 5) == static_cast<std::uint64_t>(group) &&
           state_of(in_proc(pid)) != 'Z';
  });
}

bool descends_from(pid_t pid, pid_t ancestor) {
  while (pid > 1 && pid != ancestor) {
    pid = parent_of(pid);
  }
  return pid == ancestor;
}

}  // namespace cie::record
