// The part of a file that lies in memory.
#pragma once

#include "ctf/metadata/file.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace cie::analysis::ctf {

class Window {
 public:
  // Reads at least `piece` bytes at a time. `file` is borrowed. `room`: memory to use, as far as it
  // suffices for these and kReadable more; borrowed.
  Window(const File& file, std::size_t piece, std::span<std::uint8_t> room = {})
      : file_(&file), piece_(piece), buffer_(room.data()), capacity_(room.size()) {}

  // Makes `want` bytes from `offset` on available, as far as the file has them. Returns how many
  // there are, which may be more. Pointers into the window are void afterwards.
  std::uint64_t show(std::uint64_t offset, std::uint64_t want);
  // Whether that is available without reading any more.
  bool holds(std::uint64_t offset, std::uint64_t length) const noexcept {
    return offset >= begin_ && offset - begin_ <= valid_ && valid_ - (offset - begin_) >= length;
  }
  // Of the offset shown last. Behind what is available kReadable more bytes may be read, whatever they
  // hold: whoever loads a few bytes at once need not ask how many there are.
  static constexpr std::size_t kReadable = 256;
  const std::uint8_t* data() const noexcept { return buffer_ + shown_; }

  // Another one whenever pointers into it have become void.
  std::uint64_t version() const noexcept { return version_; }

  const File& file() const noexcept { return *file_; }
  std::size_t piece() const noexcept { return piece_; }

 private:
  const File* file_;
  std::size_t piece_;
  std::uint8_t* buffer_;
  std::size_t capacity_;
  // That, if it is not lent. Not a vector, which would write zeros first.
  std::unique_ptr<std::uint8_t[]> own_;  // NOLINT(modernize-avoid-c-arrays): what it owns is one
  std::uint64_t begin_ = 0;              // of what is in the buffer, in the file
  std::uint64_t valid_ = 0;              // bytes
  std::size_t shown_ = 0;
  std::uint64_t version_ = 0;
};

}  // namespace cie::analysis::ctf
