#include "csv.hpp"

#include "utf8.hpp"

#include <cstddef>

namespace cie::viewer_export {

std::string csv_field(std::string_view text) {
  std::string result = valid_utf8(text);
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    return result;
  }
  for (std::size_t at = result.find('"'); at != std::string::npos; at = result.find('"', at + 2)) {
    result.insert(at, 1, '"');
  }
  return '"' + result + '"';
}

}  // namespace cie::viewer_export
