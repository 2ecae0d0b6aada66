// Keeps a file that is being written from filling the page cache.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cie::viewer_export {

// For a regular file that is written from its beginning to its end. A file of gigabytes takes no
// memory that others use: what is written is sent to the disk at once, and what is there already is
// no longer cached, but for the end of the file. Nothing waits for the disk: where it is slow,
// bytes stay in the cache until the kernel writes them, as they do without this.
class WriteBehind {
 public:
  // `descriptor`: borrowed.
  explicit WriteBehind(int descriptor) noexcept : descriptor_(descriptor) {}
  // So many bytes more were written.
  void wrote(std::size_t bytes) noexcept;

 private:
  int descriptor_;
  std::uint64_t written_ = 0;
  std::uint64_t started_ = 0;  // of them, those that go to the disk
};

}  // namespace cie::viewer_export
