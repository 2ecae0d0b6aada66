// Memory in which readers hold packets whole.
#pragma once

#include "base/prefetch.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace cie::analysis::ctf {

// One piece for all streams, in huge pages where the machine has them: a reader goes from stream to
// stream all the time, and the processor knows where so few pages are. Beside the heap, so that what
// comes after reading has no hole of this size in it.
class PacketMemory {
 public:
  // Without any.
  PacketMemory() noexcept = default;
  // Without any if the machine does not give it.
  explicit PacketMemory(std::size_t bytes) noexcept;
  PacketMemory(const PacketMemory&) = delete;
  PacketMemory& operator=(const PacketMemory&) = delete;
  PacketMemory(PacketMemory&& other) noexcept;
  PacketMemory& operator=(PacketMemory&& other) noexcept;
  ~PacketMemory();

  // A part of it that nobody has yet, aligned to a cache line; empty if there is not as much.
  std::span<std::uint8_t> take(std::size_t bytes) noexcept;
  // What such a part takes of it: with some bytes behind it that nobody may touch.
  static constexpr std::size_t size_of_part(std::size_t bytes) noexcept {
    return bytes / kCacheLine * kCacheLine + 2 * kCacheLine;
  }

 private:
  std::span<std::uint8_t> mapped_;
  std::span<std::uint8_t> free_;
};

}  // namespace cie::analysis::ctf
