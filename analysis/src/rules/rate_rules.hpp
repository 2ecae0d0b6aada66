// How often instances are released: R1, R2, R5.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kArrivalExceedsTurnaround;
extern const Rule kNoMissedRelease;
extern const Rule kRate;

}  // namespace cie::analysis
