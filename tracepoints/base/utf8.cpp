#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <array>
#include <charconv>

namespace cie {
namespace {

struct Form {
  std::size_t size;
  unsigned mask;      // bits of the first byte that carry the value
  char32_t smallest;  // anything below is an overlong form
};

constexpr Form form_of(unsigned char lead) noexcept {
  if (lead < 0x80U) {
    return {1, 0x7FU, 0};
  }
  if ((lead & 0xE0U) == 0xC0U) {
    return {2, 0x1FU, 0x80};
  }
  if ((lead & 0xF0U) == 0xE0U) {
    return {3, 0x0FU, 0x800};
  }
  if ((lead & 0xF8U) == 0xF0U) {
    return {4, 0x07U, 0x10000};
  }
  return {0, 0, 0};
}

bool is_between(char32_t c, char32_t first, char32_t last) { return c >= first && c <= last; }

// Characters that a terminal obeys or hides instead of showing.
bool is_control(char32_t c) { return c < 0x20 || is_between(c, 0x7F, 0x9F); }
bool is_invisible(char32_t c) {
  return c == 0xAD || c == 0x61C || c == 0xFEFF || is_between(c, 0x200B, 0x200F) ||
         is_between(c, 0x2028, 0x202E) || is_between(c, 0x2060, 0x206F) ||
         is_between(c, 0xFFF9, 0xFFFB) || is_between(c, 0xE0000, 0xE0FFF);
}

// Set aside by Unicode; XML 1.0 has none of the first two.
bool is_noncharacter(char32_t c) {
  return (c & 0xFFFEU) == 0xFFFE || is_between(c, 0xFDD0, 0xFDEF);
}

// Appends the number in hexadecimal, with at least so many digits.
void append_hex(std::string& text, char32_t number, std::size_t digits) {
  std::array<char, 8> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), std::uint32_t{number}, 16);
  const std::string_view written(buffer.data(), static_cast<std::size_t>(end - buffer.data()));
  if (written.size() < digits) text.append(digits - written.size(), '0');
  text += written;
}

}  // namespace

CodePoint first_code_point(std::string_view text) noexcept {
  const auto lead = static_cast<unsigned char>(text.front());
  const auto form = form_of(lead);
  if (form.size == 0 || text.size() < form.size) {
    return {};
  }
  char32_t value = lead & form.mask;
  for (std::size_t i = 1; i < form.size; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xC0U) != 0x80U) {
      return {};
    }
    value = (value << 6U) | (byte & 0x3FU);
  }
  const bool is_surrogate = value >= 0xD800 && value <= 0xDFFF;
  if (value < form.smallest || value > 0x10FFFF || is_surrogate) {
    return {};
  }
  return {value, form.size, true};
}

bool is_ascii(std::string_view text) noexcept {
  unsigned seen = 0;
  for (const char c : text)
    seen |= static_cast<unsigned char>(c);
  return seen < 0x80U;
}

std::string valid_utf8(std::string_view text) {
  if (is_ascii(text)) return std::string(text);
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const auto point = first_code_point(text);
    result += point.is_valid ? text.substr(0, point.size) : std::string_view("\xEF\xBF\xBD");
    text.remove_prefix(point.size);
  }
  return result;
}

bool is_unprintable(char32_t character) noexcept {
  return is_control(character) || is_invisible(character) || is_noncharacter(character);
}

std::string printable(std::string_view text) { return printable_but_for({}, text); }

std::string printable_but_for(std::string_view kept, std::string_view text) {
  if (std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; }))
    return std::string(text);
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const auto point = first_code_point(text);
    if (!point.is_valid) {
      result += "\xEF\xBF\xBD";
    } else if (!is_unprintable(point.value) || kept.find(text.front()) != std::string_view::npos) {
      result += text.substr(0, point.size);
    } else if (is_control(point.value)) {
      append_hex(result += "\\x", point.value, 2);
    } else {
      append_hex(result += "\\u{", point.value, 1);
      result += '}';
    }
    text.remove_prefix(point.size);
  }
  return result;
}

}  // namespace cie
