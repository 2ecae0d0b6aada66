#include "xml.hpp"

#include <cie/tracepoints/utf8.hpp>

namespace cie::viewer_export {
namespace {

constexpr std::string_view kSpaces = "\t\r\n";  // the only controls that XML has

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : printable_but_for(kSpaces, text)) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\n':
        result += "&#10;";
        break;
      case '\r':
        result += "&#13;";
        break;
      case '\t':
        result += "&#9;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace cie::viewer_export
