// What both languages of metadata bound in types, and questions about types that both ask.
#pragma once

#include "types.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace cie::analysis::ctf {

constexpr std::uint32_t kMaxNesting = 48;
constexpr std::uint32_t kMaxIntegerBits = 64;
// Packets are looked at in windows that begin at multiples of 4096 bytes.
constexpr std::uint64_t kMaxAlign = 32'768;

constexpr bool is_alignment(std::uint64_t bits) noexcept {
  return bits != 0 && (bits & (bits - 1)) == 0 && bits <= kMaxAlign;
}

// Levels of a type whose members and element are complete.
inline std::uint32_t depth_of(const Type& type) {
  std::uint32_t below = type.element ? type.element->depth : 0;
  for (const auto& member : type.members)
    below = std::max(below, member.type->depth);
  return below + 1;
}

// Whether its values are numbers, whatever they are good for.
constexpr bool is_number(const Type& type) noexcept {
  return type.kind == Type::Kind::integer || type.kind == Type::Kind::enumeration ||
         type.kind == Type::Kind::boolean || type.kind == Type::Kind::bits ||
         type.kind == Type::Kind::leb128;
}

// A number of known size.
constexpr bool is_fixed_number(const Type& type) noexcept {
  return is_number(type) && type.kind != Type::Kind::leb128;
}

// What an integer with or without a sign can have of a range, both ends included, as its bits.
// Empty if it can have none of it.
inline std::optional<std::pair<std::uint64_t, std::uint64_t>> representable(Selection::Wide low,
                                                                            Selection::Wide high,
                                                                            bool is_signed) {
  using Wide = Selection::Wide;
  const Wide least = is_signed ? Wide{std::numeric_limits<std::int64_t>::min()} : Wide{0};
  const Wide most = is_signed ? Wide{std::numeric_limits<std::int64_t>::max()}
                              : Wide{std::numeric_limits<std::uint64_t>::max()};
  low = std::max(low, least);
  high = std::min(high, most);
  if (low > high) return std::nullopt;
  return std::pair(static_cast<std::uint64_t>(low), static_cast<std::uint64_t>(high));
}

}  // namespace cie::analysis::ctf
