// Scheduling parameters as verdicts name them.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <string>

namespace cie::analysis {

// "real-time priority 20", "nice 5".
std::string priority_text(std::int32_t kernel_priority);
// "SCHED_FIFO 80 on CPUs 0,1".
std::string describe(const ReadBack& read_back);
std::string describe(const ThreadParameters& parameters);

}  // namespace cie::analysis
