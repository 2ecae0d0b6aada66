// S1: instances that started while other parameters than the spec's were in force.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/analysis/verdict.hpp>

#include "judgement.hpp"
#include "rule_context.hpp"
#include "spec_questions.hpp"

#include <optional>

namespace cie::analysis {

// Of a thread that was read back, from its first parameters that match the entry on. `callback`: judged alone,
// by what was read back while the thread was announced for it; empty: whatever ran there.
void judge_started_otherwise(const RuleContext& context, ThreadIndex thread,
                             std::optional<CallbackIndex> callback, const SpecEntry& entry,
                             Judgement& judgement);

// " (since change 2 of its parameters)".
Note since_change(const ReadBack& applied);
// " (the request failed with EPERM: Operation not permitted)"; empty: it did not.
Note failure_of(const ReadBack& applied);

}  // namespace cie::analysis
