// What the scheduling spec asks of callbacks and threads, and whether they got it.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "model/facts.hpp"
#include "rule_context.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace cie::analysis {

// The predicate holds for the entry of a callback.
template <typename Predicate>
bool specifies_any(const RuleContext& context, const Predicate& predicate) {
  return context.options.spec != nullptr &&
         std::ranges::any_of(context.options.spec->callbacks(), predicate);
}

const SpecEntry* spec_entry(const RuleContext& context, const CallbackFacts& callback);
// What an entry asks for.
using EntryQuestion = bool (*)(const SpecEntry& entry);
// Which entry is its own is not known: why not. An entry that does not ask for that is of no concern where
// the choice is between one and none.
std::optional<Evidence> unknown_entry(const RuleContext& context, const CallbackFacts& callback,
                                      EntryQuestion asks);
// The same of an identified one alone: one of its id was made before it, which has an entry and may be gone.
std::optional<Evidence> unknown_former(const RuleContext& context, const CallbackFacts& callback,
                                       EntryQuestion asks);
// What its entry allows of that, 0 without one. Where it is not known which entry is its own, the
// most that is allowed by one that may be.
std::uint64_t most_allowed(const RuleContext& context, const CallbackFacts& callback,
                           std::optional<std::uint64_t> SpecEntry::*limit);
// Of a thread that is no callback's own: a worker, a dispatcher, one of a pool.
const SpecEntry* entry_of_name(const RuleContext& context, const ThreadFacts& thread);
// For a thread: the entry of its callback, or of its name.
const SpecEntry* spec_entry_of(const RuleContext& context, ThreadIndex index);
// "robot.yaml:12".
std::string place(const RuleContext& context, int line);
// "robot.yaml:12 asks for SCHED_FIFO 20".
Note asks(const RuleContext& context, const SpecEntry& entry);
// What is judged (policy with its parameters, time slice, utilization clamps, affinity) is as asked
// for. Empty if only the recording, which is older than those fields, leaves it open.
std::optional<bool> is_as_specified(const ReadBack& read_back, const ThreadParameters& parameters);
// A request that did not fail asked for something else. The kernel sets a policy with its parameters
// as it is asked to; it may leave out CPUs and round slices.
bool was_asked_otherwise(const ReadBack& applied, const ThreadParameters& parameters);
bool judges_parameters(const ThreadParameters& parameters) noexcept;

}  // namespace cie::analysis
