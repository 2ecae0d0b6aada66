// M4: a callback stays with its thread.
#pragma once

#include "model/facts.hpp"
#include "rule.hpp"

namespace cie::analysis {

class Judgement;

// The callback's moves to threads that replaced one of its own.
void claim_moves(const RuleContext& context, CallbackIndex callback, Judgement& judgement);

extern const Rule kMappingPersistent;

}  // namespace cie::analysis
