#include "file.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie::analysis::ctf {

class File::Descriptor {
 public:
  explicit Descriptor(const std::string& path) noexcept
      : number_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
    if (is_kept_) --all_kept;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const noexcept { return number_; }
  // Whether it may stay open.
  bool keep() noexcept {
    constexpr int kMostKept = 64;
    is_kept_ = ++all_kept <= kMostKept;
    if (!is_kept_) --all_kept;
    return is_kept_;
  }

 private:
  static inline std::atomic<int> all_kept = 0;
  int number_;
  bool is_kept_ = false;
};

template <typename Use>
auto File::with_descriptor(Use use) const noexcept {
  if (kept_) return use(kept_->get());
  const Descriptor descriptor(path_);
  return use(descriptor.get());
}

File::File(std::string path) : path_(std::move(path)) {
  auto opened = std::make_shared<Descriptor>(path_);
  const auto& descriptor = *opened;
  struct stat status {};
  if (descriptor.get() < 0 || ::fstat(descriptor.get(), &status) != 0) {
    error_ = std::strerror(errno);
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    error_ = "not a regular file";
    return;
  }
  constexpr std::uint64_t kBlock = 512;  // stat(2): whatever the file system's is
  size_ = static_cast<std::uint64_t>(status.st_size);
  stored_ = std::min(size_, static_cast<std::uint64_t>(status.st_blocks) * kBlock);
  if (opened->keep()) kept_ = std::move(opened);
}

std::uint64_t File::data_from(std::uint64_t offset) const noexcept {
  if (stored_ == size_ || offset >= size_) return offset;
  return with_descriptor([&](int descriptor) {
    const auto found = ::lseek(descriptor, static_cast<off_t>(offset), SEEK_DATA);
    if (found >= 0) return static_cast<std::uint64_t>(found);
    return errno == ENXIO ? size_ : offset;
  });
}

std::uint64_t File::hole_bytes(std::uint64_t offset, std::uint64_t length) const noexcept {
  if (stored_ == size_) return 0;
  return with_descriptor([&](int descriptor) {
    const auto end = static_cast<off_t>(offset + length);
    std::uint64_t bytes = 0;
    for (auto at = static_cast<off_t>(offset); at < end;) {
      const auto hole = ::lseek(descriptor, at, SEEK_HOLE);
      if (hole < 0 || hole >= end) break;
      auto data = ::lseek(descriptor, hole, SEEK_DATA);
      if (data < 0 && errno != ENXIO) break;
      if (data < 0 || data > end) data = end;
      bytes += static_cast<std::uint64_t>(data - hole);
      at = data;
    }
    return bytes;
  });
}

std::size_t File::read(std::uint64_t offset, std::span<std::uint8_t> to) const noexcept {
  return with_descriptor([&](int descriptor) {
    std::size_t done = 0;
    while (done < to.size()) {
      const auto got = ::pread(descriptor, to.data() + done, to.size() - done,
                               static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      done += static_cast<std::size_t>(got);
    }
    return done;
  });
}

std::vector<std::filesystem::path> stream_files(const std::filesystem::path& directory,
                                                std::error_code& error) {
  namespace fs = std::filesystem;
  std::vector<fs::path> paths;
  fs::directory_iterator entry(directory, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    const auto name = entry->path().filename().string();
    std::error_code ignored;
    if (name == "metadata" || name.starts_with('.') || !entry->is_regular_file(ignored)) continue;
    paths.push_back(entry->path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace cie::analysis::ctf
