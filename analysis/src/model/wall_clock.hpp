// What the clocks on the walls of a recording's hosts showed.
#pragma once

#include "facts.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis {

// CLOCK_REALTIME - CLOCK_MONOTONIC. Empty where a stream does not tell, or two disagree by more
// than a second.
std::optional<std::int64_t> clock_offset_ns(const Model& model);
// When the earliest stream that tells began, by CLOCK_REALTIME of its host. Empty: none tells.
std::optional<std::int64_t> begin_realtime_ns(const Model& model);

}  // namespace cie::analysis
