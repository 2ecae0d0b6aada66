#include "keeping/chunk_names.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kChunkPrefix = "chunk-";
constexpr std::string_view kKernelPrefix = "kernel-";

fs::path numbered(const fs::path& directory, std::string_view prefix, std::uint64_t number) {
  return directory / fmt::format("{}{:06}", prefix, number);
}

bool has_prefix(const fs::path& directory, std::string_view prefix) {
  return directory.filename().string().starts_with(prefix);
}

}  // namespace

fs::path chunk_directory(const fs::path& recording, std::uint64_t number) {
  return numbered(recording, kChunkPrefix, number);
}

bool is_chunk(const fs::path& directory) { return has_prefix(directory, kChunkPrefix); }

std::uint64_t chunk_number(const fs::path& directory) {
  const std::string name = directory.filename().string();
  return std::strtoull(name.c_str() + name.rfind('-') + 1, nullptr, 10);
}

fs::path kernel_part_directory(const fs::path& recording, std::uint64_t number) {
  return numbered(recording, kKernelPrefix, number);
}

bool is_kernel_part(const fs::path& directory) { return has_prefix(directory, kKernelPrefix); }

fs::path snapshot_directory(const fs::path& recording, std::uint64_t number) {
  return recording / fmt::format("snapshot-{:03}", number);
}

std::vector<fs::path> directories_in(const fs::path& directory) {
  std::vector<fs::path> found;
  if (fs::is_directory(directory)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
      if (entry.is_directory()) found.push_back(entry.path());
    }
  }
  std::ranges::sort(found, {}, chunk_number);
  return found;
}

std::vector<fs::path> chunks_in(const fs::path& directory) {
  std::vector<fs::path> chunks = directories_in(directory);
  std::erase_if(chunks, [](const fs::path& path) { return !is_chunk(path); });
  return chunks;
}

}  // namespace cie::record
