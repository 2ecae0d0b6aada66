// Decoding of text that may not be what it claims.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace cie::viewer_export {

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

}  // namespace cie::viewer_export
