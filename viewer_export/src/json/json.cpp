#include "json.hpp"

#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

bool is_plain(char c) {
  return static_cast<unsigned char>(c) - 0x20U < 0x5FU && c != '"' && c != '\\';
}

constexpr std::size_t kWord = sizeof(std::uint64_t);
constexpr std::uint64_t each(std::uint64_t byte) { return 0x0101010101010101U * byte; }

// Of a word of characters at once: the upper bit of a byte of any of the five becomes 1 where the
// character is not of ASCII, is below a space, a quote, a backslash or DEL (Warren: Hacker's Delight,
// 6-1); whatever a borrow makes of the bytes above it, one is 1 already.
bool are_plain(const char* characters) {
  std::uint64_t word = 0;
  std::memcpy(&word, characters, kWord);
  const auto quote = (word ^ each('"')) - each(1);
  const auto backslash = (word ^ each('\\')) - each(1);
  const auto del = (word ^ each(0x7F)) - each(1);
  return ((word | (word - each(' ')) | quote | backslash | del) & each(0x80)) == 0;
}

// Two of them beyond U+FFFF.
void append_escaped(std::string& to, char32_t character) {
  constexpr char32_t kBeyond = 0x10000;
  if (character < kBeyond) {
    fmt::format_to(std::back_inserter(to), "\\u{:04x}", std::uint32_t{character});
    return;
  }
  const auto rest = std::uint32_t{character - kBeyond};
  fmt::format_to(std::back_inserter(to), "\\u{:04x}\\u{:04x}", 0xD800U + (rest >> 10U),
                 0xDC00U + (rest & 0x3FFU));
}

// A document means the same with such characters escaped, which stand in its strings alone. Control
// characters below a space are.
std::string without_unprintable(std::string&& document) {
  const auto is_suspect = [](char c) { return static_cast<unsigned char>(c) >= 0x7FU; };
  if (std::ranges::none_of(document, is_suspect)) return std::move(document);
  std::string result;
  result.reserve(document.size());
  for (std::string_view rest = document; !rest.empty();) {
    const auto point = first_code_point(rest);
    if (point.value >= 0x7F && is_unprintable(point.value)) {
      append_escaped(result, point.value);
    } else {
      result += rest.substr(0, point.size);
    }
    rest.remove_prefix(point.size);
  }
  return result;
}

}  // namespace

void write_json(std::ostream& out, const Json& document) {
  out << without_unprintable(document.dump(2, ' ', false, Json::error_handler_t::replace)) << '\n';
}

Json object_json(const std::map<std::string, std::string>& values) {
  Json::object_t object;
  object.reserve(values.size());
  for (const auto& [key, value] : values)
    object.emplace_back(key, value);
  return object;
}

std::string json_text(const Json& value) {
  return without_unprintable(value.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string json_string(std::string_view text) { return json_text(Json(text)); }

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
