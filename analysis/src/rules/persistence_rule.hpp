// M4: a callback stays with its thread.
#pragma once

#include "knowledge/claims.hpp"
#include "model/facts.hpp"
#include "rule.hpp"

namespace cie::analysis {

// The callback's moves to threads that replaced one of its own.
Claims<const Move*> claim_moves(const RuleContext& context, CallbackIndex callback);

extern const Rule kMappingPersistent;

}  // namespace cie::analysis
