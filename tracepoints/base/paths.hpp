// What paths say of each other, whatever is there.
#pragma once

#include <algorithm>
#include <filesystem>

namespace cie {

// Not that directory itself. Both are compared as they are written.
inline bool is_below(const std::filesystem::path& path, const std::filesystem::path& directory) {
  const auto [end, rest] = std::ranges::mismatch(directory, path);
  return end == directory.end() && rest != path.end();
}

}  // namespace cie
