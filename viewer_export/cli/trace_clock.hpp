// How a trace's clock stands to wall-clock time, from the metadata of its CTF traces.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::cli {

// The text of a CTF 1.8 metadata file, with or without packets. Damaged packets end it.
std::string metadata_text(std::string_view bytes);

// CLOCK_REALTIME - CLOCK_MONOTONIC in nanoseconds as the metadata's clock says; empty when it has
// no clock in nanoseconds.
std::optional<std::int64_t> clock_offset_ns(std::string_view metadata);

// The offset that all traces below the paths share within a second; the first one's, in order of
// path. Empty when they differ or none is found. Never throws for what is on disk.
std::optional<std::int64_t> find_clock_offset(const std::vector<std::filesystem::path>& traces);

}  // namespace cie::cli
