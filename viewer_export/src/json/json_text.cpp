#include "json_text.hpp"

#include "json.hpp"

#include <algorithm>
#include <cmath>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kBuffer = std::size_t{64} << 10U;

char* quoted(std::string_view text, char* to) {
  *to++ = '"';
  to = std::ranges::copy(text, to).out;
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

char* JsonText::break_line(char* at) const noexcept {
  const auto size = line_size();
  if (size == 0) return at;
  *at = '\n';
  return std::fill_n(at + 1, size - 1, ' ');
}

char* JsonText::separate(std::size_t size) {
  auto* at = room(1 + line_size() + size);
  if (!is_empty_) *at++ = ',';
  is_empty_ = false;
  return break_line(at);
}

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
