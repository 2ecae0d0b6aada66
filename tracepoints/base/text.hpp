// Lists and numbers in texts: how they are written, and how they are read.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace cie {

// "a, b, c".
template <typename Texts>
std::string joined(const Texts& texts, std::string_view separator = ", ") {
  std::string all;
  for (const std::string_view text : texts) {
    if (!all.empty()) all.append(separator);
    all.append(text);
  }
  return all;
}

// "1 loss", "2 losses".
inline std::string counted(std::uint64_t count, std::string_view noun) {
  const std::string_view plural = noun.ends_with('s') ? "es" : "s";
  return std::to_string(count).append(" ").append(noun).append(count == 1 ? "" : plural);
}

// The number that the whole text is; empty if it is none, or too large for N. `base`: of an integer
// that is not decimal.
template <typename N, typename... Base>
std::optional<N> parse_number(std::string_view text, Base... base) {
  N value{};
  const auto* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value, base...);
  if (error != std::errc{} || rest != end) return std::nullopt;
  return value;
}

}  // namespace cie
