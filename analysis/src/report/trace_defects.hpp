// What a reader of the numbers must know of the trace itself.
#pragma once

#include <cie/analysis/report.hpp>

#include "model/facts.hpp"
#include "rules/thread_lives.hpp"

#include <vector>

namespace cie::analysis {

// Those that there are, in the order of DefectKind.
std::vector<TraceDefect> trace_defects(const Model& model, const ThreadLives& lives);

}  // namespace cie::analysis
