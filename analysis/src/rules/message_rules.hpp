// Q1, Q2: messages arrive, and in time.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kNoQueueOverflow;
extern const Rule kChainBounds;

}  // namespace cie::analysis
