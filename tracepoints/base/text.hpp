// Lists, numbers and names in texts: how they are written, and how numbers are read.
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
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

// "1 loss", "2 losses"; "1 was", "2 were" where `many` says so.
std::string counted(std::uint64_t count, std::string_view noun, std::string_view many = {});

// With quotation marks around it.
std::string in_quotes(const std::filesystem::path& name);

// One argument for a POSIX shell; with what cannot be printed as $'a\012b' (POSIX.1-2024, bash, zsh).
std::string shell_quoted(std::string_view text);

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
