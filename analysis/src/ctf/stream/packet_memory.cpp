#include "packet_memory.hpp"

#include <utility>

#include <sanitizer/asan_interface.h>
#include <sys/mman.h>

namespace cie::analysis::ctf {

PacketMemory::PacketMemory(std::size_t bytes) noexcept {
  if (bytes == 0) return;
  void* const memory =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return;
  madvise(memory, bytes, MADV_HUGEPAGE);  // without them it is slower
  ASAN_POISON_MEMORY_REGION(memory, bytes);
  mapped_ = free_ = {static_cast<std::uint8_t*>(memory), bytes};
}

PacketMemory::PacketMemory(PacketMemory&& other) noexcept
    : mapped_(std::exchange(other.mapped_, {})), free_(std::exchange(other.free_, {})) {}

PacketMemory& PacketMemory::operator=(PacketMemory&& other) noexcept {
  std::swap(mapped_, other.mapped_);
  std::swap(free_, other.free_);
  return *this;
}

PacketMemory::~PacketMemory() {
  if (mapped_.empty()) return;
  ASAN_UNPOISON_MEMORY_REGION(mapped_.data(), mapped_.size());
  munmap(mapped_.data(), mapped_.size());
}

std::span<std::uint8_t> PacketMemory::take(std::size_t bytes) noexcept {
  const auto size = size_of_part(bytes);
  if (size > free_.size()) return {};
  const auto part = free_.first(bytes);
  free_ = free_.subspan(size);
  ASAN_UNPOISON_MEMORY_REGION(part.data(), part.size());
  return part;
}

}  // namespace cie::analysis::ctf
