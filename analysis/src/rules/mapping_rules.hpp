// M2, M3, M4, M7: the mapping of callbacks to threads is one-to-one and stays.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kOneCallbackPerThread;
extern const Rule kOneThreadPerCallback;
extern const Rule kMappingPersistent;
extern const Rule kUniqueLogicalId;

}  // namespace cie::analysis
