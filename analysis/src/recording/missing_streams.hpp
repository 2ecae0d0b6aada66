// Stream files of which a trace's directory shows that LTTng wrote them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cie::analysis {

// Why files of the trace in `directory` are missing, a line each: "events_3 is missing, and events_2 is here". LTTng's
// tracer of user space makes a file for each channel and each CPU that may ever be there, even if nothing ran on it,
// and an index for each file. Of other tracers' traces none is known to be missing.
std::vector<std::string> missing_streams(const std::filesystem::path& directory);

}  // namespace cie::analysis
