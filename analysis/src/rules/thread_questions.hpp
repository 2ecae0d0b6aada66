// Small questions about threads that several rules ask.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::analysis {

struct RuleContext;

inline const ThreadFacts& thread_of(const Model& model, ThreadIndex index) {
  return model.threads[at(index)];
}
// thread 4008 "lidar"
std::string thread_name(const ThreadFacts& thread);

// It told of its end itself. Another thread may do so when it is long gone.
bool is_fini_own(const ThreadFacts& thread) noexcept;
// It may be the thread that ended before, announced again unseen, or running on as where exit() was
// called.
bool may_be_former(const RuleContext& context, const ThreadFacts& thread);
// Announced with role callback.
bool is_isolated(const ThreadFacts& thread) noexcept;
// Announced with another one: a worker, a dispatcher, one of a pool.
bool is_of_other_role(const ThreadFacts& thread) noexcept;
// Where a callback ran, of its own for certain, on threads that are no callback's: of a pool, workers.
std::vector<const CallbackOnThread*> on_shared_threads(const Model& model,
                                                       const CallbackFacts& callback);
// From one announcement of a thread to the next one for another callback or group. Of a thread without
// such it is all its time.
struct Announcement {
  EventRef at{};  // thread_init
  std::optional<CallbackId> callback{};
  std::optional<GroupId> group{};
  Timestamp after{};  // the end of the one before
  std::optional<EventRef> fini{};
  Timestamp next = kLatest;       // thread_init of the next one
  std::uint32_t last_change = 0;  // as of ThreadFacts

  bool holds(const ReadBack& read_back) const noexcept {
    const auto end = fini && next != kLatest ? fini->time : next;
    return read_back.at.time >= after && read_back.at.time <= end;
  }
  // Of whatever happens on the thread, as far as it can tell.
  bool may_hold(Timestamp time) const noexcept { return time >= after && time <= next; }
};
// In their order. Requires that it was announced.
std::vector<Announcement> announcements_of(const ThreadFacts& thread);
bool is_for(const Announcement& announcement, const CallbackFacts& callback) noexcept;
// The last one for the callback; null: for whatever callback. Requires that there is one.
Announcement announcement_of(const ThreadFacts& thread, const CallbackFacts* callback);
// The thread was announced last for that callback of its process, or for its group without naming one.
bool is_announced_for(const ThreadFacts& thread, const CallbackFacts& callback) noexcept;
// The same of any of its announcements, and of any callback.
bool is_registered_to(const ThreadFacts& thread, const CallbackFacts& callback) noexcept;
// Of a thread that ran callbacks.
const EventRef& first_start_on(const ThreadFacts& thread);
// The read-back that stands for what was applied last: `applied`, or the first audit of a process
// that was attached to. Null if there is none.
const ReadBack* last_applied(const Model& model, const ThreadFacts& thread) noexcept;
// The same of the time when it was announced for the callback.
const ReadBack* last_applied(const Model& model, const ThreadFacts& thread,
                             const CallbackFacts& callback);
// An audit told that the parameters of the announced thread change, and no `applied` followed: since then
// it may run as either says.
std::optional<Evidence> unended_change(const Model& model, const ThreadFacts& thread,
                                       const Announcement& announcement);
// The same of any of its announcements, or of a thread that was never announced.
std::optional<Evidence> unended_change(const Model& model, const ThreadFacts& thread);

}  // namespace cie::analysis
