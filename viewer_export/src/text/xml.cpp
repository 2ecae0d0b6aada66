#include "xml.hpp"

#include <cie/tracepoints/utf8.hpp>

namespace cie::viewer_export {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

bool is_allowed(const CodePoint& c) {
  return c.is_valid && c.value >= 0x20 && c.value != 0xFFFE && c.value != 0xFFFF;
}

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const auto c = first_code_point(text);
    switch (c.value) {
      case U'&':
        result += "&amp;";
        break;
      case U'<':
        result += "&lt;";
        break;
      case U'>':
        result += "&gt;";
        break;
      case U'"':
        result += "&quot;";
        break;
      case U'\n':
        result += "&#10;";
        break;
      case U'\r':
        result += "&#13;";
        break;
      case U'\t':
        result += "&#9;";
        break;
      default:
        result += is_allowed(c) ? text.substr(0, c.size) : kReplacement;
    }
    text.remove_prefix(c.size);
  }
  return result;
}

}  // namespace cie::viewer_export
