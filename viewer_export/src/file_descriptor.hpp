// Owns one open file.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace cie::viewer_export {

class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int descriptor) noexcept : descriptor_(descriptor) {}
  ~FileDescriptor() { close(); }
  FileDescriptor(FileDescriptor&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }

  bool is_open() const noexcept { return descriptor_ >= 0; }
  int get() const noexcept { return descriptor_; }
  // False when the system reports that earlier writes failed; errno says why.
  bool close() noexcept;

 private:
  int descriptor_ = -1;
};

// Throws WriteError: "<what>: <text of error>".
[[noreturn]] void throw_write_error(const std::string& what, int error);

// Writes everything or throws WriteError naming `object`.
void write_all(int descriptor, std::string_view bytes, const std::string& object);

}  // namespace cie::viewer_export
