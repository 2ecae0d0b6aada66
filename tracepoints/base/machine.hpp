// What the kernel tells of the machine and its processes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace cie {

// Empty if the file cannot be read.
std::string first_line(const std::filesystem::path& file);

std::string host_name();
// Which of the machine's boots this is.
std::string boot_id();

// Of a process in /proc, by its pid or as "self". It may end at any time: empty then.
// A number of its `stat`, by its place in proc(5), which is above 3.
std::optional<std::uint64_t> stat_field(const std::string& process, int place);
// When it was created, on CLOCK_MONOTONIC. The kernel's tick of 10 ms shows.
std::optional<std::int64_t> start_ns(const std::string& process);
// By what its CLOCK_MONOTONIC is ahead of the machine's: 0, unless it is in a time namespace. Empty also
// where the kernel has none, or does not tell.
std::optional<std::int64_t> monotonic_offset_ns(const std::string& process);

}  // namespace cie
