#include "csv.hpp"

#include "utf8.hpp"

namespace cie::viewer_export {

std::string csv_field(std::string_view text) {
  const bool is_quoted = text.find_first_of(",\"\r\n") != std::string_view::npos;
  std::string result(is_quoted ? "\"" : "");
  while (!text.empty()) {
    const auto point = first_code_point(text);
    if (!point.is_valid) {
      result += "\xEF\xBF\xBD";
    } else if (point.value == U'"') {
      result += "\"\"";
    } else {
      result += text.substr(0, point.size);
    }
    text.remove_prefix(point.size);
  }
  result += is_quoted ? "\"" : "";
  return result;
}

}  // namespace cie::viewer_export
