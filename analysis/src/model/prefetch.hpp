// Asking for memory before it is needed.
#pragma once

#include <cstdint>

namespace cie::analysis {

// Compilers take a function that does nothing else for one without effect, and leave out calls of it
// that are not inlined at once; an empty statement of assembler has an effect.
[[gnu::always_inline]] inline void ask_for(const void* line) noexcept {
  __builtin_prefetch(line, 1);
  asm volatile("");
}

// Brings what lies there, and will be written, into the cache: all lines of it.
inline void prefetch_lines(const void* begin, const void* end) noexcept {
  constexpr std::uintptr_t kCacheLine = 64;
  const auto* line = static_cast<const char*>(begin);
  line -= reinterpret_cast<std::uintptr_t>(line) % kCacheLine;
  for (; line < end; line += kCacheLine)
    ask_for(line);
}

// The same of an object. Null does nothing.
template <typename T>
void prefetch_to_write(const T* object) noexcept {
  if (object != nullptr) prefetch_lines(object, object + 1);
}

// The same of its first line only.
template <typename T>
void prefetch_head(const T* object) noexcept {
  ask_for(object);
}

}  // namespace cie::analysis
