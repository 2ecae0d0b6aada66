// M5: a callback that comes back after a restart is the same as before.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kMappingSurvivesRestart;

}  // namespace cie::analysis
