// A field that all events of a class have at one place: it is read from there when it is asked for.
#pragma once

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
  std::int8_t slot = -1;  // which the vocabulary asked for; -1: none
  bool is_signed = false;
  std::uint8_t shift_left = 0;
  std::uint8_t shift_right = 0;
  std::uint32_t offset = 0;  // bytes from the layout's begin
  std::uint32_t length = 0;  // of a text, with what follows its NUL
  const LabelTable* labels = nullptr;

  std::uint64_t load(const std::uint8_t* begin) const noexcept {
    std::uint64_t raw = 0;
    std::memcpy(&raw, begin + offset, sizeof raw);
    raw <<= shift_left;
    return is_signed ? static_cast<std::uint64_t>(static_cast<std::int64_t>(raw) >> shift_right)
                     : raw >> shift_right;
  }
  std::string_view text(const std::uint8_t* begin) const noexcept {
    const auto* characters = reinterpret_cast<const char*>(begin + offset);
    return {characters, ::strnlen(characters, length)};
  }
};

}  // namespace cie::analysis
