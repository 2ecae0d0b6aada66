// M4: a callback stays with its thread.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kMappingPersistent;

}  // namespace cie::analysis
