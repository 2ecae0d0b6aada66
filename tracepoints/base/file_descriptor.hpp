// An open file descriptor; closed with its owner.
#pragma once

#include <cerrno>
#include <utility>

#include <unistd.h>

namespace cie {

class FileDescriptor {
 public:
  FileDescriptor() noexcept = default;
  explicit FileDescriptor(int descriptor) noexcept : descriptor_(descriptor) {}
  ~FileDescriptor() { close(); }
  FileDescriptor(FileDescriptor&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    other.close();
    return *this;
  }

  int get() const noexcept { return descriptor_; }
  bool is_open() const noexcept { return descriptor_ >= 0; }
  // False when the system reports that earlier writes failed; errno says why. Linux has closed it
  // even where a signal interrupted that.
  bool close() noexcept {
    return !is_open() || ::close(std::exchange(descriptor_, -1)) == 0 || errno == EINTR;
  }

 private:
  int descriptor_ = -1;
};

}  // namespace cie
