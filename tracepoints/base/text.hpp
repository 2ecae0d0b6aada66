// Lists in messages.
#pragma once

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

}  // namespace cie
