#include "system/text.hpp"

#include <algorithm>
#include <string_view>

namespace cie::record {

std::string in_quotes(const std::filesystem::path& name) { return '"' + name.string() + '"'; }

std::string in_shell_quotes(const std::filesystem::path& path) {
  std::string text = path.string();
  const bool is_plain = std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/._-+=:,@").find(c) != std::string_view::npos;
  });
  if (is_plain && !text.empty()) {
    return text;
  }
  std::string result = "'";
  for (const char c : text) {
    result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return result + '\'';
}

std::string in_number(std::uint64_t count, std::string_view one, std::string_view many) {
  return std::to_string(count) + ' ' + std::string(count == 1 ? one : many);
}

}  // namespace cie::record
