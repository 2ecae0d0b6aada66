// M2, M3, M7: the mapping of callbacks to threads is one-to-one, and so are their ids.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kOneCallbackPerThread;
extern const Rule kOneThreadPerCallback;
extern const Rule kUniqueLogicalId;

}  // namespace cie::analysis
