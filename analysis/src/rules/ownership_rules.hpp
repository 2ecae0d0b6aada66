// M6, M8, M9: a callback's thread does that callback's work and nothing else, and is announced.
#pragma once

#include "proof.hpp"
#include "rule.hpp"

#include <map>

namespace cie::analysis {

extern const Rule kNoForeignWork;
extern const Rule kSingleCallbackGroup;
extern const Rule kThreadKnown;

// Threads that ran callbacks, were never announced, and of which it is not proven that they never
// were (M9 is INCONCLUSIVE): rules about isolated threads are INCONCLUSIVE there as well.
std::map<ThreadIndex, Evidence> unknown_threads(const Model& model, const Proof& proof);

}  // namespace cie::analysis
