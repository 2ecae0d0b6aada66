// Numbers that lie close to each other, spread for a table.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cie::analysis {

// Spreads numbers over all 64 bits (Knuth: The Art of Computer Programming 3, 6.4).
struct SpreadBits {
  template <typename Number>
  std::uint64_t operator()(Number number) const noexcept {
    return static_cast<std::uint64_t>(number) * 0x9e3779b97f4a7c15U;
  }
};

}  // namespace cie::analysis
