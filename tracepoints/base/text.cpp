#include "text.hpp"

#include <cie/tracepoints/utf8.hpp>

namespace cie {

std::string counted(std::uint64_t count, std::string_view noun, std::string_view many) {
  std::string text = std::to_string(count) + ' ';
  if (count != 1 && !many.empty()) return text.append(many);
  const std::string_view plural = noun.ends_with('s') || noun.ends_with("ch") ? "es" : "s";
  return text.append(noun).append(count == 1 ? "" : plural);
}

std::string in_quotes(const std::filesystem::path& name) { return '"' + name.string() + '"'; }

std::string shell_quoted(std::string_view text) {
  constexpr std::string_view kSafe =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:@%+=,";
  if (!text.empty() && text.find_first_not_of(kSafe) == std::string_view::npos) {
    return std::string(text);
  }
  // What a terminal does not print, and ' with it, by numbers: they are pasted as they are read.
  if (printable(text) != text) {
    const auto octal = [](unsigned byte, unsigned shift) {
      return static_cast<char>('0' + (byte >> shift & 7U));
    };
    std::string result = "$'";
    for (const auto c : text) {
      const auto byte = static_cast<unsigned char>(c);
      const bool is_plain = byte >= ' ' && byte < 0x7f && c != '\'' && c != '\\';
      result += is_plain ? std::string(1, c)
                         : std::string{'\\', octal(byte, 6), octal(byte, 3), octal(byte, 0)};
    }
    return result + "'";
  }
  std::string result = "'";
  for (const char c : text) {
    result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return result + "'";
}

}  // namespace cie
