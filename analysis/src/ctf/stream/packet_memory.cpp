#include "packet_memory.hpp"

#include <new>

#include <sanitizer/asan_interface.h>
#include <sys/mman.h>

namespace cie::analysis::ctf {
namespace {

constexpr std::size_t kHugePage = 2U << 20U;

std::uint8_t* allocate(std::size_t bytes) noexcept {
  if (bytes < kHugePage) return new (std::nothrow) std::uint8_t[bytes];
  void* const memory =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return nullptr;
  madvise(memory, bytes, MADV_HUGEPAGE);  // without them it is slower
  return static_cast<std::uint8_t*>(memory);
}

}  // namespace

PacketMemory::PacketMemory(std::size_t bytes) noexcept : memory_(allocate(bytes), {bytes}) {
  if (memory_ == nullptr) return;
  ASAN_POISON_MEMORY_REGION(memory_.get(), bytes);
  free_ = {memory_.get(), bytes};
}

void PacketMemory::Free::operator()(std::uint8_t* memory) const noexcept {
  ASAN_UNPOISON_MEMORY_REGION(memory, bytes);
  if (bytes < kHugePage) {
    delete[] memory;
  } else {
    munmap(memory, bytes);
  }
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
