// T1, T2, T5, T6: whether the recording itself can be relied on.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kTraceReadable;
extern const Rule kNoLoss;
extern const Rule kRequiredEvents;
extern const Rule kTimeSane;

}  // namespace cie::analysis
