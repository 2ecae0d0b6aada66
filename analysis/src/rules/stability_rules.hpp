// S3, S4, S5: parameters stay as applied, bind the thread to its CPUs and do not leak to children.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kParametersUnchanged;
extern const Rule kAllowedCpusOnly;
extern const Rule kNoParameterLeak;

}  // namespace cie::analysis
