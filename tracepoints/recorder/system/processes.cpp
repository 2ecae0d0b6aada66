#include "system/processes.hpp"

#include "base/machine.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

std::string in_proc(pid_t pid) { return std::to_string(pid); }

}  // namespace

std::string process_name(pid_t pid) { return first_line("/proc/" + in_proc(pid) + "/comm"); }

bool is_asleep(pid_t pid) {
  std::error_code error;
  std::filesystem::directory_iterator threads("/proc/" + in_proc(pid) + "/task", error);
  for (const std::filesystem::directory_iterator end; !error && threads != end;
       threads.increment(error)) {
    const std::string stat = first_line(threads->path() / "stat");
    const auto after_name = stat.rfind(')');  // a name may have any character
    if (after_name != std::string::npos && stat.substr(after_name, 3) != ") S") return false;
  }
  return true;
}

pid_t parent_of(pid_t pid) { return static_cast<pid_t>(stat_field(in_proc(pid), 4).value_or(0)); }

std::optional<std::uint64_t> start_ticks(pid_t pid) { return stat_field(in_proc(pid), 22); }

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
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    const auto pid = static_cast<pid_t>(std::strtol(name.c_str(), nullptr, 10));
    if (pid <= 0 || stat_field(in_proc(pid), 5) != static_cast<std::uint64_t>(group)) continue;
    const std::string stat = first_line("/proc/" + in_proc(pid) + "/stat");
    const std::size_t name_end = stat.rfind(") ");
    const bool has_ended = name_end != std::string::npos && stat.compare(name_end + 2, 1, "Z") == 0;
    if (!has_ended) return true;
  }
  return false;
}

bool descends_from(pid_t pid, pid_t ancestor) {
  while (pid > 1 && pid != ancestor) {
    pid = parent_of(pid);
  }
  return pid == ancestor;
}

}  // namespace cie::record
