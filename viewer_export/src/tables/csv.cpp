#include "csv.hpp"

#include <cie/tracepoints/utf8.hpp>

#include <cstddef>

namespace cie::viewer_export {

bool is_formula(std::string_view text) noexcept {
  return !text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos;
}

std::string csv_field(std::string_view text) {
  std::string result = is_formula(text) ? '\'' + valid_utf8(text) : valid_utf8(text);
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    return result;
  }
  for (std::size_t at = result.find('"'); at != std::string::npos; at = result.find('"', at + 2)) {
    result.insert(at, 1, '"');
  }
  return '"' + result + '"';
}

}  // namespace cie::viewer_export
