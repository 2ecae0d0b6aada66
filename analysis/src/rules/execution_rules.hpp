// E1, E2, E3: instances start and end in order.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kStartEndPaired;
extern const Rule kNonReentrant;
extern const Rule kNoNesting;

}  // namespace cie::analysis
