#include "file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie {
namespace {

// What errno has no number for.
class NoFileCategory final : public std::error_category {
 public:
  const char* name() const noexcept override { return "no file"; }
  std::string message(int /*condition*/) const override {
    return "it is a FIFO, a device or a socket, and no file";
  }
};

[[noreturn]] void fail(int error) {
  throw std::system_error(std::error_code(error, std::generic_category()));
}

[[noreturn]] void fail_for_no_file() {
  static const NoFileCategory category;
  throw std::system_error(std::error_code(1, category));
}

// The user's own hands have put something there.
bool is_own_descriptor(const std::filesystem::path& file) {
  const std::string& name = file.native();
  return name == "/dev/stdin" || name.starts_with("/dev/fd/") || name.starts_with("/proc/self/fd/");
}

}  // namespace

FileDescriptor open_to_read(const std::filesystem::path& file) {
  constexpr int kFlags = O_RDONLY | O_CLOEXEC | O_NOCTTY;
  const bool is_own = is_own_descriptor(file);
  FileDescriptor opened(::open(file.c_str(), is_own ? kFlags : kFlags | O_NONBLOCK));
  struct stat status {};
  if (!opened.is_open() || ::fstat(opened.get(), &status) != 0) {
    // So it is with a socket, or a device that is not there.
    if (errno == ENXIO || errno == ENODEV) fail_for_no_file();
    fail(errno);
  }
  if (S_ISDIR(status.st_mode)) fail(EISDIR);
  if (!S_ISREG(status.st_mode) && !is_own) fail_for_no_file();
  return opened;
}

std::string read_all(const FileDescriptor& file, std::size_t most) {
  std::string text;
  std::array<char, 65536> block{};
  while (text.size() < most) {
    const auto size = ::read(file.get(), block.data(), std::min(block.size(), most - text.size()));
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) fail(errno);
    if (size == 0) break;
    text.append(block.data(), static_cast<std::size_t>(size));
  }
  return text;
}

std::string read_file(const std::filesystem::path& file, std::size_t most) {
  return read_all(open_to_read(file), most);
}

void write_all(const FileDescriptor& file, std::string_view bytes) {
  while (!bytes.empty()) {
    const auto size = ::write(file.get(), bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) fail(errno);
    bytes.remove_prefix(static_cast<std::size_t>(size));
  }
}

}  // namespace cie
