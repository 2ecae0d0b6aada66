// How long instances take: R3, R4.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kDeadline;
extern const Rule kBudget;

}  // namespace cie::analysis
