// Processes in a time namespace: their CLOCK_MONOTONIC is not the machine's, and the tracer gives their events
// its times.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <map>
#include <optional>

namespace cie::analysis {

// Processes of the host do not share a clock, and lie in the same streams: in what order what happened is
// not known. Empty: they do.
std::optional<Evidence> clocks_apart(const Model& model, HostIndex host);
// The same of all hosts that have such.
std::map<HostIndex, Evidence> clocks_apart(const Model& model);

// The kernel's events of the host cannot be related to a process of its: they are no evidence of that.
std::optional<Evidence> apart_from_kernel(const Model& model, HostIndex host);

}  // namespace cie::analysis
