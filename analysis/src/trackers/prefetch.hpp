// Asking for memory before it is needed.
#pragma once

#include <cstddef>

namespace cie::analysis {

// Brings an object that will be written into the cache, all lines of it. Null does nothing.
template <typename T>
void prefetch_to_write(const T* object) noexcept {
  constexpr std::size_t kCacheLine = 64;
  const auto* bytes = reinterpret_cast<const char*>(object);
  for (std::size_t at = 0; at < sizeof(T); at += kCacheLine)
    __builtin_prefetch(bytes + at, 1);
}

// The same of its first line only.
template <typename T>
void prefetch_head(const T* object) noexcept {
  __builtin_prefetch(object, 1);
}

}  // namespace cie::analysis
