// S1 and S2 for recordings without thread_sched, such as those of ROS 2: what sched_switch tells of
// the threads that a callback ran on. It tells priorities and CPUs: not whether SCHED_FIFO or
// SCHED_RR, nor what SCHED_DEADLINE may use, nor which CPUs were allowed but not used.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include "judgement.hpp"
#include "rule_context.hpp"

namespace cie::analysis {

// The callback's recorder reads no parameters back, whatever happens.
bool is_never_read_back(const CallbackFacts& callback) noexcept;

// Whether its threads were scheduled as the spec asks, when they were seen last.
void judge_scheduled(const RuleContext& context, const CallbackFacts& callback,
                     const SpecEntry& entry, Judgement& judgement);

// Whether the thread of its first instance was scheduled so before that instance.
void judge_scheduled_before(const RuleContext& context, CallbackIndex index, const SpecEntry& entry,
                            Judgement& judgement);

}  // namespace cie::analysis
