// A message as bytes, in plain CDR.
#pragma once

#include "message_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>

namespace cie::executor {

// View of what travels: four bytes that say how it is encoded, then the message, a multiple of four
// bytes. Cyclone aligns by the distance from the beginning of the memory, so the message stands at
// a multiple of eight, and the length before the encoding.
class CdrBytes {
 public:
  static constexpr std::uint32_t kEncoding = sizeof(std::uint32_t);
  static constexpr std::uint32_t kMessage = 2 * sizeof(std::uint32_t);
  static constexpr std::uint32_t kMostSize = std::numeric_limits<std::int32_t>::max();

  explicit CdrBytes(unsigned char* memory) noexcept : memory_(memory) {}

  unsigned char* encoding() const noexcept { return memory_ + kEncoding; }
  unsigned char* message() const noexcept { return memory_ + kMessage; }
  // Of encoding and message.
  std::uint32_t size() const noexcept {
    std::uint32_t size = 0;
    std::memcpy(&size, memory_, sizeof size);
    return size;
  }
  // Writes length and encoding around a message of so many bytes in this machine's byte order. The
  // memory has three bytes more.
  void complete(std::uint32_t message_size) const noexcept;

 private:
  unsigned char* memory_;
};

struct FreeCdrBytes {
  void operator()(unsigned char* memory) const noexcept;
};
using CdrBytesPtr = std::unique_ptr<unsigned char, FreeCdrBytes>;

// Null if the message has a value that its type forbids.
CdrBytesPtr cdr_of(const MessageLayout& layout, const void* message) noexcept;
// An encoding and no message: what is sent for a message that cannot be, and for a key.
CdrBytesPtr cdr_of_nothing() noexcept;
// For encoding and message of so many bytes, and complete(). Null if there cannot be such a
// message, or no memory.
CdrBytesPtr room_for_cdr(std::size_t size) noexcept;

}  // namespace cie::executor
