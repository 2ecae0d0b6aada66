// Small questions about threads, callbacks and parameters that several rules ask.
#pragma once

#include <cie/analysis/verdict.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace cie::analysis {

struct RuleContext;

// An instance that ended after its thread's `thread_fini`: where its start was not seen, that may have
// been later, too.
std::optional<Evidence> end_after_fini(const ThreadFacts& thread, const CallbackOnThread& pair);
// It may be the thread that ended before, announced again unseen, or running on as where exit() was
// called.
bool may_be_former(const RuleContext& context, const ThreadFacts& thread);
// Announced with role callback.
bool is_isolated(const ThreadFacts& thread) noexcept;
// The thread was announced for the callback, or for its group without naming a callback.
bool is_registered_to(const ThreadFacts& thread, const CallbackFacts& callback) noexcept;
// Of a thread that ran callbacks.
const EventRef& first_start_on(const ThreadFacts& thread);
// Why the runs of the callback on a thread may be another one's; empty: some is its own.
std::optional<Evidence> perhaps_anothers(const CallbackOnThread& pair);
// Why its threads may be those of another process with that pid; empty: they are not.
std::optional<Evidence> perhaps_another_process(const CallbackFacts& callback);
// Neither is so: the callback ran on that thread.
bool is_there_for_certain(const Model& model, const CallbackOnThread& pair) noexcept;
// Its logical id is known, and so are its kind, its deadline and its entry in the spec.
bool is_identified(const CallbackFacts& callback) noexcept;
// When it was registered, where its first callback_init tells that: an announcement repeats what may be
// much older. All of an announcement comes from one thread.
std::optional<Timestamp> registration(const RuleContext& context, const CallbackFacts& callback);
// "its registration was not seen", or what else is why it is not.
std::string_view why_unidentified(const CallbackFacts& callback) noexcept;
// Of a registered one the last: its fini, an end, a start, its registration.
EventRef last_sign(const CallbackFacts& callback);
bool is_real_time(std::int32_t policy) noexcept;
// "real-time priority 20", "nice 5".
std::string priority_text(std::int32_t kernel_priority);

// The read-back that stands for what was applied last: `applied`, or the first audit of a process
// that was attached to. Null if there is none.
const ReadBack* last_applied(const Model& model, const ThreadFacts& thread) noexcept;
// Such an audit may not be the first one of the attached process: why not.
std::optional<Evidence> doubt_of_first_audit(const RuleContext& context, ThreadIndex thread);

// "SCHED_FIFO 80 on CPUs 0,1".
std::string describe(const ReadBack& read_back);
std::string describe(const ThreadParameters& parameters);
// What is judged (policy with its parameters, time slice, utilization clamps, affinity) is as asked
// for. Empty if only the recording, which is older than those fields, leaves it open.
std::optional<bool> is_as_specified(const ReadBack& read_back, const ThreadParameters& parameters);
// A request that did not fail asked for something else. The kernel sets a policy with its parameters
// as it is asked to; it may leave out CPUs and round slices.
bool was_asked_otherwise(const ReadBack& applied, const ThreadParameters& parameters);
bool judges_parameters(const ThreadParameters& parameters) noexcept;

const SpecEntry* spec_entry(const RuleContext& context, const CallbackFacts& callback);
// Which entry is its own is not known: why not.
std::optional<Evidence> unknown_entry(const RuleContext& context, const CallbackFacts& callback);
// What its entry allows of that, 0 without one. Where it is not known which entry is its own, the
// most that is allowed by one that may be.
std::uint64_t most_allowed(const RuleContext& context, const CallbackFacts& callback,
                           std::optional<std::uint64_t> SpecEntry::*limit);
// For a thread: the entry of its callback, or, for a worker, of its name.
const SpecEntry* spec_entry_of(const RuleContext& context, ThreadIndex index);
// "robot.yaml:12".
std::string place(const RuleContext& context, int line);
// "robot.yaml:12 asks for SCHED_FIFO 20".
std::string asks(const RuleContext& context, const SpecEntry& entry);
std::string nanoseconds(std::int64_t value);
inline std::string nanoseconds(Duration value) { return nanoseconds(value.ns); }

}  // namespace cie::analysis
