#include "commands.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <unistd.h>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;

// Beside this program first, so that a build tree and an installation each use their own.
std::vector<fs::path> search_path() {
  std::vector<fs::path> directories;
  std::error_code error;
  const auto self = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    directories.push_back(self.parent_path());
  }
  const char* path = std::getenv("PATH");
  std::string_view rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const auto end = std::min(rest.find(':'), rest.size());
    if (end > 0) {  // an empty entry would mean the current directory
      directories.emplace_back(rest.substr(0, end));
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return directories;
}

}  // namespace

std::optional<std::string> find_program(const std::string& name) {
  for (const auto& directory : search_path()) {
    const auto program = directory / name;
    if (::access(program.c_str(), X_OK) == 0 && !fs::is_directory(program)) return program;
  }
  return std::nullopt;
}

std::string program_path(const std::string& name) {
  if (const auto found = find_program(name)) return *found;
  const auto directories = search_path();
  const auto beside = directories.empty() ? std::string("?") : directories.front().string();
  const std::string part = name == "cie-live"
                               ? "It comes with cie"
                               : "It comes with the package " + std::string(kRobotPackage);
  throw std::runtime_error("\"" + name + "\" is not installed: it is neither in \"" + beside +
                           "\" nor in PATH. " + part);
}

void start_program(const std::string& name, const Arguments& arguments) {
  const auto program = program_path(name);
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const auto& argument : arguments) {
    argv.push_back(const_cast<char*>(argument.c_str()));
  }
  argv.push_back(nullptr);
  ::execv(program.c_str(), argv.data());
  throw std::runtime_error("cannot start \"" + program +
                           "\": " + std::generic_category().message(errno));
}

}  // namespace cie::cli
