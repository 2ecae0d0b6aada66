#include "json_text.hpp"

#include "json.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kBuffer = std::size_t{64} << 10U;
constexpr std::string_view kLine = "\n                               ";  // as indented as it may be

char* quoted(std::string_view text, char* to) {
  *to++ = '"';
  to += text.copy(to, text.size());
  *to++ = '"';
  return to;
}

}  // namespace

void JsonText::flush() {
  out_.write(text_.data(), at_ - text_.data());
  at_ = text_.data();
}

void JsonText::make_room(std::size_t size) {
  flush();
  text_.resize(std::max({text_.size(), kBuffer, size}));
  at_ = text_.data();
  end_ = at_ + text_.size();
}

[[gnu::always_inline]] inline char* JsonText::begin_line(bool has_comma, std::size_t size) {
  const auto line = line_size();
  auto* at = room(1 + kLine.size() + line + size);
  *at = ',';
  at += has_comma ? 1 : 0;
  // All of it, whose size the compiler knows: no more of it counts than the line has.
  kLine.copy(at, kLine.size());
  if (line > kLine.size()) [[unlikely]]
    std::fill(at + kLine.size(), at + line, ' ');
  return at + line;
}

[[gnu::always_inline]] inline char* JsonText::separate(std::size_t size) {
  return begin_line(!std::exchange(is_empty_, false), size);
}

void JsonText::begin_last_line() { at_ = begin_line(false, 0); }

void JsonText::element() { at_ = separate(0); }

void JsonText::key(std::string_view name) {
  constexpr std::size_t kMarks = 4;
  auto* at = quoted(name, separate(name.size() + kMarks));
  *at++ = ':';
  if (indentation_ != kOneLine) *at++ = ' ';
  at_ = at;
}

void JsonText::value(std::string_view value) {
  if (!needs_no_escape(value)) return verbatim(json_string(value));
  constexpr std::size_t kQuotes = 2;
  at_ = quoted(value, room(value.size() + kQuotes));
}

// As Json does, whose digits are not always the shortest.
void JsonText::value(double value) {
  if (!std::isfinite(value)) return null();
  constexpr std::size_t kDigits = 64;
  auto* digits = room(kDigits);
  at_ = nlohmann::detail::to_chars(digits, digits + kDigits, value);
}

}  // namespace cie::viewer_export
