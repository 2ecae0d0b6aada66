// Processes that are seen to have one pid.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

namespace cie::analysis {

// What shows it; of one with `shares_pid_since`.
Evidence shared_pid(const ProcessFacts& process);

}  // namespace cie::analysis
