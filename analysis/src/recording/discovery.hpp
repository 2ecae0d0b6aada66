// Finds the CTF traces below what the user named.
#pragma once

#include <filesystem>
#include <vector>

namespace cie::analysis {

// So many directories deep below what the user named.
inline constexpr int kMaxDepth = 16;

// Directories below `path` (itself included) that hold a file "metadata", or packets that have lost
// theirs, in order of their names.
// Throws UnreadableTrace when `path` cannot be read or holds none.
std::vector<std::filesystem::path> find_traces(const std::filesystem::path& path);

}  // namespace cie::analysis
