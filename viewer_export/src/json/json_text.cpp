#include "json_text.hpp"

#include "json.hpp"

#include <cmath>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kBuffer = std::size_t{64} << 10U;

}  // namespace

void JsonText::flush() {
  out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
  text_.clear();
}

void JsonText::break_line() {
  if (indentation_ == kOneLine) return;
  text_ += '\n';
  text_.append(depth_ * static_cast<std::size_t>(indentation_), ' ');
}

void JsonText::separate() {
  if (text_.size() >= kBuffer) flush();
  if (!is_empty_) text_ += ',';
  is_empty_ = false;
  break_line();
}

void JsonText::key(std::string_view name) {
  separate();
  text_ += '"';
  text_ += name;
  text_ += indentation_ == kOneLine ? "\":" : "\": ";
}

void JsonText::value(std::string_view value) { append_json_string(text_, value); }

// As Json does, whose digits are not always the shortest.
void JsonText::value(double value) {
  if (!std::isfinite(value)) return null();
  std::array<char, 64> digits{};
  text_.append(digits.data(), nlohmann::detail::to_chars(digits.begin(), digits.end(), value));
}

}  // namespace cie::viewer_export
