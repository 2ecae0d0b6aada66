// M5: what the threads of a callback were applied in two of its lifetimes.
#pragma once

#include "judgement.hpp"
#include "model/facts.hpp"

namespace cie::analysis {

struct RuleContext;

// It certainly neither ran nor had a thread that was read back.
bool has_never_run(const RuleContext& context, const CallbackFacts& callback);

// Whether they are the same, as far as read-backs tell.
void compare_parameters(const RuleContext& context, CallbackIndex index_before,
                        CallbackIndex index_after, const std::vector<Evidence>& beside,
                        Judgement& judgement);

}  // namespace cie::analysis
