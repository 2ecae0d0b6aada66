// Asking for memory before it is needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace cie {

inline constexpr std::size_t kCacheLine = 64;  // bytes

enum class Access : int { read = 0, write = 1 };

// Compilers take a function that does nothing else for one without effect, and leave out calls of it
// that are not inlined at once; an empty statement of assembler has an effect.
template <Access access = Access::write>
[[gnu::always_inline]] inline void prefetch_line(const void* line) noexcept {
  __builtin_prefetch(line, static_cast<int>(access));
  asm volatile("");
}

// The same of a place that will be written. Null does nothing.
inline void prefetch_place(const void* place) noexcept {
  if (place != nullptr) prefetch_line(place);
}

// All lines of what lies there and will be written.
inline void prefetch_lines(const void* begin, const void* end) noexcept {
  const auto* line = static_cast<const char*>(begin);
  line -= reinterpret_cast<std::uintptr_t>(line) % kCacheLine;
  for (; line < end; line += kCacheLine)
    prefetch_line(line);
}

// The same of an object. Null does nothing.
template <typename T>
void prefetch_to_write(const T* object) noexcept {
  if (object != nullptr) prefetch_lines(object, object + 1);
}

// The same of what will be read.
inline void prefetch_to_read(std::span<const std::byte> memory) noexcept {
  for (std::size_t i = 0; i < memory.size(); i += kCacheLine)
    prefetch_line<Access::read>(&memory[i]);
}
template <typename T>
void prefetch_to_read(const T* object) noexcept {
  prefetch_to_read(std::as_bytes(std::span(object, 1)));
}

// The same of its first line only.
template <typename T>
void prefetch_head(const T* object) noexcept {
  prefetch_line(object);
}

}  // namespace cie
