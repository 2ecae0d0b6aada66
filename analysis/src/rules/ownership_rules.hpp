// M6, M8, M9: a callback's thread does that callback's work and nothing else, and is announced.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kNoForeignWork;
extern const Rule kSingleCallbackGroup;
extern const Rule kThreadKnown;

}  // namespace cie::analysis
