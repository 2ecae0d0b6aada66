// Lists and numbers in messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

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

}  // namespace cie
