// Stream files of which a trace's directory shows that LTTng wrote them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace cie::analysis {

// Why files of the traces in `directories` are missing, for each directory a line each: "events_3 is missing, and
// events_2 is here". LTTng's tracer of user space makes a file for each channel and each CPU that may ever be there, even
// if nothing ran on it, and an index for each file. What lies in another directory, as parts of one trace may, is there.
// Of other tracers' traces none is known to be missing.
std::vector<std::vector<std::string>> missing_streams(
    std::span<const std::filesystem::path> directories);

}  // namespace cie::analysis
