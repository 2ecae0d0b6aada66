#include "write_behind.hpp"

#include <fcntl.h>

namespace cie::viewer_export {
namespace {

constexpr std::uint64_t kPiece = std::uint64_t{8} << 20U;
constexpr std::uint64_t kCached = std::uint64_t{64} << 20U;  // of the end of the file

}  // namespace

void WriteBehind::wrote(std::size_t bytes) noexcept {
  written_ += bytes;
  for (; written_ >= started_ + kPiece; started_ += kPiece) {
    // Both are hints: where they fail the file is written all the same.
    ::sync_file_range(descriptor_, static_cast<::off64_t>(started_), kPiece, SYNC_FILE_RANGE_WRITE);
    if (started_ >= beginning_ + kCached) {
      ::posix_fadvise(descriptor_, static_cast<::off_t>(started_ - kCached), kPiece,
                      POSIX_FADV_DONTNEED);
    }
  }
}

}  // namespace cie::viewer_export
