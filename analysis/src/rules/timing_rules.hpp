// R1 to R5: response times, releases, deadlines, budgets and rates are within their bounds.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kArrivalExceedsTurnaround;
extern const Rule kNoMissedRelease;
extern const Rule kDeadline;
extern const Rule kBudget;
extern const Rule kRate;

}  // namespace cie::analysis
