// A Snapshot as JSON: schema cie.live/1, which README.md of this folder describes.
#pragma once

#include "snapshot.hpp"

#include <string>
#include <string_view>

namespace cie::live {

// One line without its end. `with_recent`: with the instances of each callback.
std::string json_line(const Snapshot& snapshot, bool with_recent);

// What json_line() wrote. Throws std::runtime_error for anything else.
Snapshot parse_snapshot(std::string_view line);

}  // namespace cie::live
