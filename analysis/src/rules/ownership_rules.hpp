// M8, M9: a callback has a group of its own, and a thread that is announced.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kSingleCallbackGroup;
extern const Rule kThreadKnown;

}  // namespace cie::analysis
