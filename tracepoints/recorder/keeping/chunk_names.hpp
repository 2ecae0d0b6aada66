// Where the chunks or snapshots of a recording are, and what belongs to them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace cie::record {

// DIR/chunk-000001, …: one that is complete, with its manifest.
std::filesystem::path chunk_directory(const std::filesystem::path& recording, std::uint64_t number);
bool is_chunk(const std::filesystem::path& directory);
// Of any directory whose name ends with "-" and its number, as LTTng's own do.
std::uint64_t chunk_number(const std::filesystem::path& directory);

// Where kernel events are until their chunk is sealed: the first part is number 1.
std::filesystem::path kernel_part_directory(const std::filesystem::path& recording,
                                            std::uint64_t number);
bool is_kernel_part(const std::filesystem::path& directory);

// DIR/snapshot-001, …: one that is complete, with its manifest.
std::filesystem::path snapshot_directory(const std::filesystem::path& recording,
                                         std::uint64_t number);

// By number; none if `directory` is none.
std::vector<std::filesystem::path> directories_in(const std::filesystem::path& directory);
// Directories of the chunks in a recording, oldest first.
std::vector<std::filesystem::path> chunks_in(const std::filesystem::path& directory);

}  // namespace cie::record
