#include "machine.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <sstream>
#include <system_error>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

std::vector<std::string> lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> result;
  for (std::string line; std::getline(stream, line);)
    result.push_back(line);
  return result;
}

}  // namespace

bool Machine::is_root() const {
  const auto ids = words(status("Uid").value_or(""));  // real, effective, saved, of the file system
  return ids.size() > 1 && ids[1] == "0";
}

bool Machine::has_right(unsigned capability) const {
  return has_capability(capability).value_or(false);
}

bool Machine::is_in_group(const std::string& name) const {
  const auto own = words(status("Groups").value_or(""));
  for (const auto& line : lines(text("/etc/group").value_or(""))) {
    std::istringstream fields(line);
    std::string group;
    std::string password;
    std::string id;
    std::getline(fields, group, ':');
    std::getline(fields, password, ':');
    std::getline(fields, id, ':');
    if (group == name) return std::ranges::find(own, id) != own.end();
  }
  return false;
}

bool Machine::has_program(const std::string& name) const {
  const char* const all = std::getenv("PATH");
  std::istringstream folders(all != nullptr ? all : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (has(folder.append(1, '/').append(name))) return true;
  return false;
}

std::vector<std::string> Machine::listening_sockets() const {
  constexpr std::string_view kListening = "00010000";
  constexpr std::size_t kFlags = 3;
  constexpr std::size_t kPath = 7;
  std::vector<std::string> paths;
  for (const auto& line : lines(text("/proc/net/unix").value_or(""))) {
    const auto fields = words(line);
    if (fields.size() > kPath && fields[kFlags] == kListening) paths.push_back(fields[kPath]);
  }
  return paths;
}

std::optional<std::uint64_t> Machine::free_bytes(const fs::path& folder) const {
  std::error_code error;
  const auto space = fs::space(path(folder), error);
  if (error) return std::nullopt;
  return space.available;
}

}  // namespace cie::cli
