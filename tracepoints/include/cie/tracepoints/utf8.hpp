// Text that may not be what it claims: what traces, other machines and files call things.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace cie {

struct CodePoint {
  char32_t value = 0;
  std::size_t size = 1;   // bytes taken
  bool is_valid = false;  // false: the bytes are no UTF-8
};

// The first code point. Rejects overlong forms, surrogates and values beyond U+10FFFF.
CodePoint first_code_point(std::string_view text) noexcept;

// Most text: bytes below 0x80 alone.
bool is_ascii(std::string_view text) noexcept;

// Invalid bytes become U+FFFD; everything else is unchanged.
std::string valid_utf8(std::string_view text);

// Valid UTF-8 without anything that moves a cursor or reorders text: control characters become
// \xNN, invisible and bidirectional controls and what is no character \u{NNNN}, invalid bytes
// U+FFFD.
std::string printable(std::string_view text);
// The same, but for the characters of `kept`.
std::string printable_but_for(std::string_view kept, std::string_view text);

// Of those that printable() escapes.
bool is_unprintable(char32_t character) noexcept;

}  // namespace cie
