// Small questions about threads that several rules ask.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <optional>
#include <string>

namespace cie::analysis {

struct RuleContext;

inline const ThreadFacts& thread_of(const Model& model, ThreadIndex index) {
  return model.threads[at(index)];
}
// thread 4008 "lidar"
std::string thread_name(const ThreadFacts& thread);

// It told of its end itself. Another thread may do so when it is long gone.
bool is_fini_own(const ThreadFacts& thread) noexcept;
// An instance that ended after its thread's `thread_fini`: where its start was not seen, that may have
// been later, too.
std::optional<Evidence> end_after_fini(const ThreadFacts& thread, const CallbackOnThread& pair);
// It may be the thread that ended before, announced again unseen, or running on as where exit() was
// called.
bool may_be_former(const RuleContext& context, const ThreadFacts& thread);
// Announced with role callback.
bool is_isolated(const ThreadFacts& thread) noexcept;
// Announced with another one: a worker, a dispatcher, one of a pool.
bool is_of_other_role(const ThreadFacts& thread) noexcept;
// The thread was announced for the callback, or for its group without naming a callback.
bool is_registered_to(const ThreadFacts& thread, const CallbackFacts& callback) noexcept;
// Of a thread that ran callbacks.
const EventRef& first_start_on(const ThreadFacts& thread);
// The read-back that stands for what was applied last: `applied`, or the first audit of a process
// that was attached to. Null if there is none.
const ReadBack* last_applied(const Model& model, const ThreadFacts& thread) noexcept;
// Such an audit may not be the first one of the attached process: why not.
std::optional<Evidence> doubt_of_first_audit(const RuleContext& context, ThreadIndex thread);

}  // namespace cie::analysis
