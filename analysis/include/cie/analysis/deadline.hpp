// What "late" means, for whoever judges or counts instances.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstdint>
#include <optional>

namespace cie::analysis {

// The response deadline that a callback has to keep: that of its entry in the spec, else the one it
// declares itself (0: none). `entry` may be null.
std::optional<Duration> response_deadline(const SpecEntry* entry,
                                          std::uint64_t declared_ns) noexcept;

// What is certain of an instance's response time: all of it where its release is known exactly, a
// lower bound elsewhere. Empty while it is open.
std::optional<Duration> least_response_time(const Instance& instance) noexcept;

}  // namespace cie::analysis
