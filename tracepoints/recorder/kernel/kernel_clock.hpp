// The clock that a kernel trace has in common with the user-space trace beside it.
#pragma once

#include "kernel/ctf_stream.hpp"

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace cie::record {

// CLOCK_MONOTONIC now.
std::uint64_t monotonic_ns();
// As measured here and now.
TraceClock measured_clock();
// Takes over the clock of the user-space trace below `recording`; false if its metadata is not
// there yet. `kernel` is the directory of the kernel's own.
bool find_clock(const std::filesystem::path& recording, const std::filesystem::path& kernel,
                TraceClock& clock);
// Writes DIRECTORY/metadata (kernel_metadata()), whole or not at all: a reader may look at any time. Throws
// std::system_error.
void write_kernel_metadata(const Directory& directory, const TraceUuid& uuid,
                           const TraceClock& clock, std::string_view route);

}  // namespace cie::record
