// Room on the disk that is recorded to.
#pragma once

#include <cstdint>
#include <filesystem>

namespace cie::record {

// Not a byte more can be written. File systems keep a part for root; those that count no blocks
// (capacity 0, or unknown) are never full.
constexpr bool is_full(const std::filesystem::space_info& space, bool is_root) noexcept {
  constexpr auto kUnknown = static_cast<std::uintmax_t>(-1);
  if (space.capacity == 0 || space.capacity == kUnknown) return false;
  return (is_root ? space.free : space.available) == 0;
}

}  // namespace cie::record
