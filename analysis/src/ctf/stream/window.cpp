#include "window.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace cie::analysis::ctf {

std::uint64_t Window::show(std::uint64_t offset, std::uint64_t want) {
  const auto end = begin_ + valid_;
  if (holds(offset, want)) {
    shown_ = static_cast<std::size_t>(offset - begin_);
    return end - offset;
  }
  ++version_;
  const auto size = file_->size();
  if (offset >= size) {
    begin_ = offset;
    valid_ = 0;
    shown_ = 0;
    return 0;
  }
  const auto length = static_cast<std::size_t>(
      std::min<std::uint64_t>(std::max<std::uint64_t>(want, piece_), size - offset));
  std::size_t kept = 0;
  const auto* const old = buffer_;
  auto own_until_kept = std::unique_ptr<std::uint8_t[]>();  // NOLINT(modernize-avoid-c-arrays)
  if (capacity_ < length + kReadable) {
    capacity_ = length + kReadable;
    own_until_kept = std::exchange(own_, std::make_unique_for_overwrite<std::uint8_t[]>(capacity_));
    buffer_ = own_.get();
  }
  if (offset >= begin_ && offset < end) {
    kept = static_cast<std::size_t>(std::min<std::uint64_t>(end - offset, length));
    std::memmove(buffer_, old + (offset - begin_), kept);
  }
  begin_ = offset;
  shown_ = 0;
  valid_ = kept + file_->read(offset + kept, {buffer_ + kept, length - kept});
  std::memset(buffer_ + valid_, 0, kReadable);
  return valid_;
}

}  // namespace cie::analysis::ctf
