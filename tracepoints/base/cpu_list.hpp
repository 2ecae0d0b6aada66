#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cie {

// "0,2,3".
inline std::string cpu_list(const std::vector<std::uint32_t>& cpus) {
  std::string text;
  for (const auto cpu : cpus) {
    text += text.empty() ? "" : ",";
    text += std::to_string(cpu);
  }
  return text;
}

}  // namespace cie
