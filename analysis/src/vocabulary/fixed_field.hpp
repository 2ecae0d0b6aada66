// A field that all events of a class have at one place: it is read from there when it is asked for.
#pragma once

#include <cie/analysis/context_number.hpp>

#include "label_table.hpp"

#include <cstdint>
#include <cstring>
#include <string_view>

namespace cie::analysis {

// A little-endian integer of at most 64 bits within eight bytes, or the characters of an array.
struct FixedField {
  // Loads take eight bytes whatever they are for: so many must be readable behind a layout.
  static constexpr std::uint64_t kSlack = 8;

  enum class Kind : std::uint8_t { absent, integer, text };
  Kind kind = Kind::absent;
  std::int8_t slot = -1;     // which the vocabulary asked for; -1: none
  std::uint8_t shift = 0;    // bits of its first byte that are not its own
  std::uint8_t bytes = 0;    // that it fills; 0: not whole ones, or not 1, 2, 4 or 8
  std::uint32_t offset = 0;  // bytes from the layout's begin
  std::uint32_t length = 0;  // of a text, with what follows its NUL
  bool is_int32 = false;     // all of four bytes, with a sign
  std::uint64_t mask = 0;    // its bits, without the shift
  std::uint64_t sign = 0;    // its highest bit if that is a sign
  const LabelTable* labels = nullptr;

  // The bytes at its place, as many as the integer has.
  template <typename Integer>
  Integer whole(const std::uint8_t* begin) const noexcept {
    Integer value = 0;
    std::memcpy(&value, begin + offset, sizeof value);
    return value;
  }
  // Without branches, since what a field is cannot be predicted where all are read. 0 if absent.
  std::uint64_t load(const std::uint8_t* begin) const noexcept {
    return (load_unsigned(begin) ^ sign) - sign;
  }
  // The same as an integer of some type, as which it is usually recorded.
  template <typename Integer>
  Integer load_as(const std::uint8_t* begin) const noexcept {
    return bytes == sizeof(Integer) ? whole<Integer>(begin) : static_cast<Integer>(load(begin));
  }
  // The same where a sign is of no interest.
  std::uint64_t load_unsigned(const std::uint8_t* begin) const noexcept {
    return whole<std::uint64_t>(begin) >> shift & mask;
  }
  // Of an integer; empty if it is none.
  void get(const std::uint8_t* begin, ContextNumber<std::int64_t>& value) const noexcept {
    // Whole, without a look at what it was: that is in another core's cache.
    if (is_int32) [[likely]] {
      value = whole<std::int32_t>(begin);
      return;
    }
    value = {};
    if (kind == Kind::integer) value = static_cast<std::int64_t>(load(begin));
  }
  std::string_view text(const std::uint8_t* begin) const noexcept {
    const auto* characters = reinterpret_cast<const char*>(begin + offset);
    return {characters, ::strnlen(characters, length)};
  }
};

}  // namespace cie::analysis
