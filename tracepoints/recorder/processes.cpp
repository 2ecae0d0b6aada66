#include "processes.hpp"

#include <fstream>
#include <sstream>

namespace cie::record {
namespace {

std::string first_line(pid_t pid, const char* file_name) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/" + file_name);
  std::string line;
  std::getline(file, line);
  return line;
}

// A number of /proc/PID/stat, by its place in proc(5), which is above 3.
std::optional<std::uint64_t> stat_field(pid_t pid, int place) {
  const std::string text = first_line(pid, "stat");
  const std::size_t name_end = text.rfind(')');  // the name may hold anything
  if (name_end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream fields(text.substr(name_end + 1));
  std::string field;
  for (int at = 3; at <= place; ++at) {
    fields >> field;
  }
  std::uint64_t number = 0;
  std::istringstream digits(field);
  if (!fields || !(digits >> number)) {
    return std::nullopt;
  }
  return number;
}

}  // namespace

std::string process_name(pid_t pid) { return first_line(pid, "comm"); }

pid_t parent_of(pid_t pid) { return static_cast<pid_t>(stat_field(pid, 4).value_or(0)); }

std::optional<std::uint64_t> start_ticks(pid_t pid) { return stat_field(pid, 22); }

bool descends_from(pid_t pid, pid_t ancestor) {
  while (pid > 1 && pid != ancestor) {
    pid = parent_of(pid);
  }
  return pid == ancestor;
}

}  // namespace cie::record
