// Keeps a file that is being written from filling the page cache.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cie::viewer_export {

// For a regular file that is written from its beginning to its end. A file of gigabytes takes no
// memory that others use: behind its beginning, what is written is sent to the disk at once, and
// what is there is no longer cached, but for the last 64 MiB. Nothing waits until it is there.
class WriteBehind {
 public:
  static constexpr std::uint64_t kBeginning = std::uint64_t{256} << 20U;

  // `descriptor`: borrowed. The first `beginning` bytes are left to the kernel, which may take all
  // the time it wants for them.
  explicit WriteBehind(int descriptor, std::uint64_t beginning = kBeginning) noexcept
      : descriptor_(descriptor), beginning_(beginning), started_(beginning) {}
  // So many bytes more were written.
  void wrote(std::size_t bytes) noexcept;

 private:
  int descriptor_;
  std::uint64_t beginning_;
  std::uint64_t written_ = 0;
  std::uint64_t started_;  // up to here they go to the disk
};

}  // namespace cie::viewer_export
