// M6: the thread of a callback does that callback's work and nothing else.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kNoForeignWork;

}  // namespace cie::analysis
