#include "json.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace cie::viewer_export {
namespace {

bool is_plain(char c) {
  return static_cast<unsigned char>(c) - 0x20U < 0x60U && c != '"' && c != '\\';
}

constexpr std::size_t kWord = sizeof(std::uint64_t);
constexpr std::uint64_t each(std::uint64_t byte) { return 0x0101010101010101U * byte; }

// Of a word of characters at once: the upper bit of a byte of any of the four becomes 1 where the
// character is not of ASCII, is below a space, a quote or a backslash (Warren: Hacker's Delight,
// 6-1); whatever a borrow makes of the bytes above it, one is 1 already.
bool are_plain(const char* characters) {
  std::uint64_t word = 0;
  std::memcpy(&word, characters, kWord);
  const auto quote = (word ^ each('"')) - each(1);
  const auto backslash = (word ^ each('\\')) - each(1);
  return ((word | (word - each(' ')) | quote | backslash) & each(0x80)) == 0;
}

}  // namespace

void write_json(std::ostream& out, const Json& document) {
  out << document.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

Json object_json(const std::map<std::string, std::string>& values) {
  Json::object_t object;
  object.reserve(values.size());
  for (const auto& [key, value] : values)
    object.emplace_back(key, value);
  return object;
}

std::string json_string(std::string_view text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

bool needs_no_escape(std::string_view text) {
  if (text.size() < kWord) return std::ranges::all_of(text, is_plain);
  // The last word may share characters with the one before it.
  for (std::size_t at = 0; at + kWord < text.size(); at += kWord) {
    if (!are_plain(text.data() + at)) return false;
  }
  return are_plain(text.data() + text.size() - kWord);
}

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
