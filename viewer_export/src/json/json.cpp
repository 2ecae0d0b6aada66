#include "json.hpp"

#include <algorithm>

namespace cie::viewer_export {
namespace {

bool is_plain(char c) {
  return static_cast<unsigned char>(c) - 0x20U < 0x60U && c != '"' && c != '\\';
}

}  // namespace

void write_json(std::ostream& out, const Json& document) {
  out << document.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

std::string json_string(std::string_view text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

bool needs_no_escape(std::string_view text) { return std::ranges::all_of(text, is_plain); }

void append_json_string(std::string& to, std::string_view text) {
  if (!needs_no_escape(text)) {
    to += json_string(text);
    return;
  }
  to += '"';
  to += text;
  to += '"';
}

}  // namespace cie::viewer_export
