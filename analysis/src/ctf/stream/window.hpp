// The part of a file that lies in memory.
#pragma once

#include "ctf/metadata/file.hpp"

#include <cstdint>
#include <vector>

namespace cie::analysis::ctf {

class Window {
 public:
  // Reads at least `piece` bytes at a time. `file` is borrowed.
  Window(const File& file, std::size_t piece) : file_(&file), piece_(piece) {}

  // Makes `want` bytes from `offset` on available, as far as the file has them. Returns how many
  // there are, which may be more. Pointers into the window are void afterwards.
  std::uint64_t show(std::uint64_t offset, std::uint64_t want);
  // Of the offset shown last.
  const std::uint8_t* data() const noexcept { return buffer_.data() + shown_; }

  const File& file() const noexcept { return *file_; }
  std::size_t piece() const noexcept { return piece_; }

 private:
  const File* file_;
  std::size_t piece_;
  std::vector<std::uint8_t> buffer_;
  std::uint64_t begin_ = 0;  // of what is in the buffer, in the file
  std::uint64_t valid_ = 0;  // bytes
  std::size_t shown_ = 0;
};

}  // namespace cie::analysis::ctf
