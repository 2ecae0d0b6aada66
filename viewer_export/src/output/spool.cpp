#include "spool.hpp"

#include "write_all.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

namespace cie::viewer_export {

std::filesystem::path temporary_place(const std::filesystem::path& directory) {
  if (!directory.empty()) return directory;
  const char* chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
}

std::string temporary_data(const std::filesystem::path& directory) {
  return "temporary data in \"" + temporary_place(directory).string() + '"' +
         (directory.empty() ? " (TMPDIR chooses another directory)" : "");
}

void Spool::open() {
  object_ = temporary_data(directory_);
  directory_ = temporary_place(directory_);
  file_ = FileDescriptor{::open(directory_.c_str(), O_TMPFILE | O_RDWR | O_EXCL | O_CLOEXEC, 0600)};
  if (!file_.is_open()) {  // a file system without nameless files
    std::string name = (directory_ / "cie.XXXXXX").string();
    file_ = FileDescriptor{::mkostemp(name.data(), O_CLOEXEC)};
    if (!file_.is_open()) {
      throw_write_error("cannot create " + object_, errno);
    }
    ::unlink(name.c_str());
  }
}

void Spool::append(std::string_view bytes) {
  if (!file_.is_open()) {
    open();
  }
  write_all(file_.get(), bytes, object_);
  size_ += bytes.size();
}

void Spool::read(std::uint64_t offset, std::span<char> bytes) const {
  while (!bytes.empty()) {
    const auto got = ::pread(file_.get(), bytes.data(), bytes.size(), static_cast<::off_t>(offset));
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      throw_write_error("cannot read back " + object_, got < 0 ? errno : EIO);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
}

void Spool::copy_to(std::ostream& out) const {
  std::vector<char> block(std::min<std::uint64_t>(size_, 1U << 20U));
  for (std::uint64_t offset = 0; offset < size_;) {
    const auto part = std::span(block).first(std::min<std::uint64_t>(block.size(), size_ - offset));
    read(offset, part);
    out.write(part.data(), static_cast<std::streamsize>(part.size()));
    offset += part.size();
  }
}

}  // namespace cie::viewer_export
