// S1 to S4 for recordings without thread_sched, such as those of ROS 2: what sched_switch tells of
// the threads that a callback ran on. It tells priorities and CPUs: not whether SCHED_FIFO or
// SCHED_RR, nor what SCHED_DEADLINE may use, nor which CPUs were allowed but not used.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include "judgement.hpp"
#include "rule_context.hpp"

#include <string>

namespace cie::analysis {

// The callback's recorder reads no parameters back, whatever happens.
bool is_never_read_back(const CallbackFacts& callback) noexcept;

// Likewise of the thread: only ROS 2's tracers tell of it, and nobody announces it.
bool is_never_read_back(const Model& model, const ThreadFacts& thread) noexcept;

// The spec's entry for the one callback that such a thread ran; null: none, or it ran several.
const SpecEntry* sole_entry(const RuleContext& context, const ThreadFacts& thread);

// What is known of it: "real-time priority 20 on CPUs 0,1". Empty: nothing.
std::string scheduled_text(const ThreadFacts& thread);

// S3: whether such a thread kept its priority from when the spec's was seen first; without a spec,
// from its first instance on.
void judge_scheduled_unchanged(const RuleContext& context, ThreadIndex index, Judgement& judgement);

// S4: whether it ran on the spec's CPUs only, from the same moment on.
void judge_scheduled_cpus(const RuleContext& context, ThreadIndex index, Judgement& judgement);

// Whether its threads were scheduled as the spec asks, when they were seen last.
void judge_scheduled(const RuleContext& context, const CallbackFacts& callback,
                     const SpecEntry& entry, Judgement& judgement);

// Whether the thread of its first instance was scheduled so before that instance.
void judge_scheduled_before(const RuleContext& context, CallbackIndex index, const SpecEntry& entry,
                            Judgement& judgement);

}  // namespace cie::analysis
