// T3, T4, M1: whether everything that happened was seen.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kSeqContiguous;
extern const Rule kRunComplete;
extern const Rule kSpecifiedCallbackSeen;

}  // namespace cie::analysis
