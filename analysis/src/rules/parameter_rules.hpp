// S1, S2: threads get the parameters that the spec asks for, before their first callback.
#pragma once

#include "rule.hpp"

namespace cie::analysis {

extern const Rule kParametersAsSpecified;
extern const Rule kParametersBeforeFirstCallback;

}  // namespace cie::analysis
