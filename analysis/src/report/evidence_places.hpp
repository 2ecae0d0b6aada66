// Where the events that verdicts rest on stand.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

namespace cie::analysis {

// Names the file and the packet of each event.
void locate_evidence(const Model& model, VerdictReport& verdicts);

}  // namespace cie::analysis
