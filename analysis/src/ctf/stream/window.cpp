#include "window.hpp"

#include <algorithm>
#include <cstring>

namespace cie::analysis::ctf {

std::uint64_t Window::show(std::uint64_t offset, std::uint64_t want) {
  const auto end = begin_ + valid_;
  if (offset >= begin_ && offset <= end && end - offset >= want) {
    shown_ = static_cast<std::size_t>(offset - begin_);
    return end - offset;
  }
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
  if (offset >= begin_ && offset < end) {
    kept = static_cast<std::size_t>(std::min<std::uint64_t>(end - offset, length));
    std::memmove(buffer_.data(), buffer_.data() + (offset - begin_), kept);
  }
  if (buffer_.size() < length) buffer_.resize(length);
  begin_ = offset;
  shown_ = 0;
  valid_ = kept + file_->read(offset + kept, {buffer_.data() + kept, length - kept});
  return valid_;
}

}  // namespace cie::analysis::ctf
