// M2, M3, M7: the mapping of callbacks to threads is one-to-one, and so are their ids.
#pragma once

#include "model/facts.hpp"
#include "rule.hpp"

namespace cie::analysis {

class Judgement;
class SignsOfLife;

// Whether threads that the callback ran on lived together.
void judge_threads_together(const RuleContext& context, SignsOfLife& signs,
                            const CallbackFacts& callback, Judgement& judgement);

extern const Rule kOneCallbackPerThread;
extern const Rule kOneThreadPerCallback;
extern const Rule kUniqueLogicalId;

}  // namespace cie::analysis
