// What "late" means.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstdint>
#include <optional>

namespace cie::analysis {

// The response deadline that a callback has to keep: that of its entry in the spec, else the one it
// declares itself (0: none). `entry` may be null.
std::optional<Duration> response_deadline(const SpecEntry* entry,
                                          std::uint64_t declared_ns) noexcept;

}  // namespace cie::analysis
