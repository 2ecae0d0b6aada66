// Numbers as bytes of files: of as many bytes as they need, and as they lie in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

namespace cie::viewer_export {

// Small where the number is near zero: 0, -1, 1, -2 … are 0, 1, 2, 3 …
constexpr std::uint64_t zigzag(std::int64_t value) noexcept {
  return static_cast<std::uint64_t>(value) << 1U ^ static_cast<std::uint64_t>(value >> 63);
}
constexpr std::int64_t unzigzag(std::uint64_t number) noexcept {
  return static_cast<std::int64_t>(number >> 1U ^ (~(number & 1U) + 1));
}

// A varint (LEB128) has seven bits to a byte, the lowest first, and a mark in each but its last.
inline constexpr std::size_t kLongestVarint = 10;

// To where there is room for the longest. Returns what follows.
inline char* put_varint(std::uint64_t number, char* out) noexcept {
  for (; number >= 0x80; number >>= 7U)
    *out++ = static_cast<char>((number & 0x7fU) | 0x80U);
  *out++ = static_cast<char>(number);
  return out;
}

inline void append_varint(std::string& out, std::uint64_t number) {
  for (; number >= 0x80; number >>= 7U)
    out += static_cast<char>((number & 0x7fU) | 0x80U);
  out += static_cast<char>(number);
}

// Of bytes that put_varint() wrote. Returns what follows.
inline const char* get_varint(const char* in, std::uint64_t& number) noexcept {
  number = 0;
  for (unsigned shift = 0;; shift += 7) {
    const auto byte = static_cast<unsigned char>(*in++);
    number |= std::uint64_t{byte & 0x7fU} << shift;
    if (byte < 0x80 || shift >= 63) return in;
  }
}

// The bytes of `value` as they lie in memory: little endian on every machine that is supported.
template <typename Number>
void append_little_endian(std::string& out, Number value) {
  static_assert(std::is_trivially_copyable_v<Number>);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace cie::viewer_export
