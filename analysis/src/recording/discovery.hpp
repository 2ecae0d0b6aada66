// Finds the CTF traces below what the user named.
#pragma once

#include <filesystem>
#include <system_error>
#include <vector>

namespace cie::analysis {

// So many directories deep below what the user named.
inline constexpr int kMaxDepth = 16;
inline constexpr const char* kMetadataName = "metadata";  // of each CTF trace's file
inline constexpr const char* kIndexDirectory = "index";   // of LTTng's, beside the streams

// Directories at and below `path`, each once, in no order. Links to directories are followed, but not
// to one that the link lies in: not in circles, and never through the whole file system.
struct Directories {
  std::vector<std::filesystem::path> found;
  std::error_code error;         // none: all could be listed
  std::filesystem::path failed;  // else which could not
};
Directories directories_in(const std::filesystem::path& path);

// Directories below `path` (itself included) that hold a file "metadata", or packets that have lost
// theirs, in order of their names.
// Throws UnreadableTrace when `path` cannot be read or holds none.
std::vector<std::filesystem::path> find_traces(const std::filesystem::path& path);

}  // namespace cie::analysis
