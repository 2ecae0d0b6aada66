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

}  // namespace

std::string process_name(pid_t pid) { return first_line(pid, "comm"); }

pid_t parent_of(pid_t pid) {
  const std::string text = first_line(pid, "stat");
  const std::size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) {
    return 0;
  }
  std::istringstream fields(text.substr(name_end + 1));
  char state = 0;
  pid_t parent = 0;
  fields >> state >> parent;
  return parent;
}

bool descends_from(pid_t pid, pid_t ancestor) {
  while (pid > 1 && pid != ancestor) {
    pid = parent_of(pid);
  }
  return pid == ancestor;
}

}  // namespace cie::record
