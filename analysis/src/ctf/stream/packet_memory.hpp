// Memory in which readers hold packets whole.
#pragma once

#include "base/prefetch.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace cie::analysis::ctf {

// One piece for all streams, in huge pages where the machine has them: a reader goes from stream to
// stream all the time, and the processor knows where so few pages are. Beside the heap, so that what
// comes after reading has no hole of this size in it; but what is smaller than such a page is of the
// heap, where fresh pages cost less.
class PacketMemory {
 public:
  // Without any.
  PacketMemory() noexcept = default;
  // Without any if the machine does not give it.
  explicit PacketMemory(std::size_t bytes) noexcept;

  // A part of it that nobody has yet, aligned to 16 bytes; empty if there is not as much.
  std::span<std::uint8_t> take(std::size_t bytes) noexcept;
  // What such a part takes of it: with some bytes behind it that nobody may touch.
  static constexpr std::size_t size_of_part(std::size_t bytes) noexcept {
    return bytes / kCacheLine * kCacheLine + 2 * kCacheLine;
  }

 private:
  struct Free {
    std::size_t bytes;
    void operator()(std::uint8_t* memory) const noexcept;
  };
  // NOLINTNEXTLINE(modernize-avoid-c-arrays): what it owns is one
  std::unique_ptr<std::uint8_t[], Free> memory_;
  std::span<std::uint8_t> free_;
};

}  // namespace cie::analysis::ctf
