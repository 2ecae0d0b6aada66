#include <cie/scheduling/thread_configurator.hpp>

#include "base/text.hpp"
#include "memory.hpp"
#include "misspelt_ids.hpp"
#include "refusal.hpp"
#include "sched_parameters.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <fmt/format.h>

namespace cie::scheduling {
namespace {

const SpecEntry* find_entry(const SchedulingSpec* spec, const SpecSubject& subject) {
  if (spec == nullptr) return nullptr;
  if (subject.callbacks.empty()) return spec->find_thread(subject.name);
  for (const SpecCallback& callback : subject.callbacks) {
    if (const SpecEntry* const entry = spec->find_callback(callback.id, callback.period_ns))
      return entry;
  }
  return nullptr;
}

SchedulingProblem problem(const SchedulingSpec* spec, const SpecEntry* entry,
                          const std::string& thread, int error, std::string reason) {
  return {.file = spec != nullptr ? spec->name() : "",
          .line = entry != nullptr ? entry->line : 0,
          .entry = entry != nullptr ? entry->id : thread,
          .thread = thread,
          .error = error,
          .reason = std::move(reason)};
}

std::vector<SchedulingProblem> conflicts_in(const SchedulingSpec* spec,
                                            const SpecSubject& subject) {
  std::vector<SchedulingProblem> found;
  if (spec == nullptr) return found;
  const SpecEntry* first = nullptr;
  for (const SpecCallback& callback : subject.callbacks) {
    const SpecEntry* const entry = spec->find_callback(callback.id, callback.period_ns);
    if (entry == nullptr) continue;
    if (first == nullptr) first = entry;
    if (entry->parameters == first->parameters) continue;
    found.push_back(problem(
        spec, entry, subject.name, 0,
        fmt::format("its group shares a thread, which line {} already configures otherwise: give "
                    "both the same parameters, or the callback a group of its own",
                    first->line)));
  }
  return found;
}

void take_policy(ThreadParameters& parameters, const trace::SchedReadBack& from) {
  parameters.policy = static_cast<Policy>(from.policy);
  parameters.nice = from.nice;
  parameters.priority = from.priority;
  parameters.runtime_ns = from.runtime_ns;
  parameters.deadline_ns = from.deadline_ns;
  parameters.period_ns = from.period_ns;
}

// What an entry asks for; where it asks for nothing any more, what the thread began with.
ThreadParameters wanted(const SpecEntry* entry, const ThreadParameters& before,
                        const trace::SchedReadBack& began) {
  ThreadParameters parameters = entry != nullptr ? entry->parameters : ThreadParameters{};
  if (!parameters.policy && before.policy) take_policy(parameters, began);
  if (!parameters.cpus && before.cpus) parameters.cpus = began.cpus;
  if (!parameters.util_min && before.util_min) parameters.util_min = began.util_min;
  if (!parameters.util_max && before.util_max) parameters.util_max = began.util_max;
  return parameters;
}

// What a thread ran as, as a request.
ThreadParameters as_request(const trace::SchedReadBack& ran, const ThreadParameters& asked) {
  ThreadParameters parameters;
  take_policy(parameters, ran);
  parameters.cpus = ran.cpus;
  parameters.has_exclusive_cpuset = asked.has_exclusive_cpuset;
  if (asked.slice_ns && ran.slice_ns != 0) parameters.slice_ns = ran.slice_ns;
  if (asked.util_min) parameters.util_min = ran.util_min;
  if (asked.util_max) parameters.util_max = ran.util_max;
  return parameters;
}

}  // namespace

// --- configuring ---------------------------------------------------------------------------------

std::vector<SchedulingProblem> ThreadConfigurator::apply(Member& member) {
  const SchedRequest outcome = request(calls_, member.thread->tid(), member.asked, cpusets_);
  const auto reported = calls_.emit(*member.thread, SchedMoment::applied, outcome.error);
  std::vector<SchedulingProblem> found;
  const auto add = [&found, &member](int error, std::string reason) {
    found.push_back(
        problem(member.spec.get(), member.entry, member.subject.name, error, std::move(reason)));
  };
  member.told.clear();
  if (reported) member.told = differences(member.asked, *reported);
  if (outcome.error != 0) {
    add(outcome.error, "cannot set " + outcome.what + ": " + outcome.reason);
  } else if (!reported) {
    if (member.entry != nullptr) add(0, "the thread ended before it could be read back");
  } else {
    for (const std::string& difference : member.told)
      add(0, "read back after setting: " + difference);
  }
  return found;
}

ThreadConfigurator::Members::iterator ThreadConfigurator::join(
    trace::Thread& thread, const SpecSubject& subject, std::vector<SchedulingProblem>& problems) {
  const std::lock_guard lock{members_mutex_};
  const auto member = members_.insert(
      members_.end(),
      Member{.thread = &thread,
             .subject = subject,
             .began = calls_.read_back(thread.tid()).value_or(trace::SchedReadBack{}),
             .spec = spec_,
             .entry = find_entry(spec_.get(), subject)});
  if (member->entry != nullptr) member->asked = member->entry->parameters;
  problems = apply(*member);
  return member;
}

void ThreadConfigurator::leave(Members::iterator member) {
  const std::lock_guard lock{members_mutex_};
  members_.erase(member);
}

ThreadConfigurator::Configured ThreadConfigurator::configure(trace::Thread& thread,
                                                             const SpecSubject& subject) {
  std::vector<SchedulingProblem> problems;
  Membership membership{*this, join(thread, subject, problems)};
  report(problems);
  return {.membership = std::move(membership), .problems = std::move(problems)};
}

std::vector<SchedulingProblem> ThreadConfigurator::configure(
    const std::shared_ptr<trace::Thread>& thread, const SpecSubject& subject) {
  std::vector<SchedulingProblem> problems;
  const auto member = join(*thread, subject, problems);
  {
    const std::lock_guard lock{members_mutex_};
    member->owner = thread;
  }
  report(problems);
  return problems;
}

std::vector<SchedulingProblem> ThreadConfigurator::conflicts(const SpecSubject& subject) {
  std::vector<SchedulingProblem> found;
  {
    const std::lock_guard lock{members_mutex_};
    found = conflicts_in(spec_.get(), subject);
  }
  report(found);
  return found;
}

std::vector<SchedulingProblem> ThreadConfigurator::lock_process_memory() {
  std::vector<SchedulingProblem> found;
  if (const int error = lock_memory(options_.lock_memory); error != 0) {
    found.push_back(problem(nullptr, nullptr, "lock_memory", error,
                            "cannot lock memory: " + why_memory_lock_refused(error, kernel_)));
  }
  report(found);
  return found;
}

std::vector<SchedulingProblem> ThreadConfigurator::prepare_stack(const std::string& thread) {
  std::vector<SchedulingProblem> found;
  if (!prefault_stack(options_.prefault_stack)) {
    found.push_back(problem(nullptr, nullptr, thread, ENOMEM,
                            fmt::format("its stack has no room for the {} bytes of "
                                        "prefault_stack: lower them, or raise `ulimit -s`",
                                        options_.prefault_stack)));
  }
  report(found);
  return found;
}

// --- changing ------------------------------------------------------------------------------------

// What happens to one thread when the spec changes.
struct ThreadConfigurator::Change {
  std::shared_ptr<trace::Thread> owner{};  // of a thread that may go otherwise
  Member* member = nullptr;
  Member former{};
  std::optional<trace::SchedReadBack> ran{};  // before; empty: the thread is gone
  bool is_made = false;
};

// Gives every member the new spec, and finds those that run otherwise than it asks.
std::vector<ThreadConfigurator::Change> ThreadConfigurator::take(const SpecPtr& spec) {
  std::vector<Change> changes;
  for (Member& member : members_) {
    const auto owner = member.owner ? member.owner->lock() : nullptr;
    if (member.owner && owner == nullptr) continue;
    changes.push_back({.owner = owner,
                       .member = &member,
                       .former = member,
                       .ran = calls_.read_back(member.thread->tid()),
                       .is_made = false});
    member.spec = spec;
    member.entry = find_entry(spec.get(), member.subject);
    member.asked = wanted(member.entry, changes.back().former.asked, member.began);
  }
  // Threads that leave SCHED_DEADLINE make room for those that come.
  std::stable_partition(changes.begin(), changes.end(), [](const Change& change) {
    return change.member->asked.policy != Policy::deadline;
  });
  return changes;
}

std::vector<SchedulingProblem> ThreadConfigurator::make(std::vector<Change>& changes) {
  std::vector<SchedulingProblem> found;
  for (Change& change : changes) {
    Member& member = *change.member;
    const bool is_needed = change.ran && (member.asked != change.former.asked ||
                                          !differences(member.asked, *change.ran).empty());
    if (!is_needed) continue;
    change.is_made = true;
    member.thread->begin_change();
    const auto problems = apply(member);
    found.insert(found.end(), problems.begin(), problems.end());
    if (!found.empty() && options_.on_error == OnError::refuse) break;
  }
  return found;
}

std::vector<SchedulingProblem> ThreadConfigurator::put_back(const std::vector<Change>& changes) {
  std::vector<SchedulingProblem> found;
  for (const Change& change : changes) {
    Member& member = *change.member;
    member = change.former;
    if (!change.is_made) continue;
    member.thread->begin_change();
    const auto outcome =
        request(calls_, member.thread->tid(), as_request(*change.ran, member.asked), cpusets_);
    calls_.emit(*member.thread, SchedMoment::applied, outcome.error);
    if (outcome.error == 0) continue;
    found.push_back(problem(member.spec.get(), member.entry, member.subject.name, outcome.error,
                            "cannot go back to " + outcome.what + ": " + outcome.reason));
  }
  return found;
}

void ThreadConfigurator::reload(SpecPtr spec) {
  const bool refuses = options_.on_error == OnError::refuse;
  std::vector<SchedulingProblem> found;
  {
    const std::lock_guard lock{members_mutex_};
    drop_orphans();
    for (const Member& member : members_) {
      const auto conflicts = conflicts_in(spec.get(), member.subject);
      found.insert(found.end(), conflicts.begin(), conflicts.end());
    }
    if (found.empty() || !refuses) {
      auto changes = take(spec);
      const auto refusals = make(changes);
      found.insert(found.end(), refusals.begin(), refusals.end());
      if (refuses && !refusals.empty()) {
        const auto stuck = put_back(changes);
        found.insert(found.end(), stuck.begin(), stuck.end());
      } else {
        spec_ = std::move(spec);
      }
    }
  }
  report(found);
  refuse_if_any(found);
}

// --- misspelt ids --------------------------------------------------------------------------------

void ThreadConfigurator::tell_misspelt(KnownIds known) {
  SpecPtr spec;
  {
    const std::lock_guard lock{members_mutex_};
    if (spec_ == nullptr || checked_ == spec_) return;
    checked_ = spec = spec_;
    for (const Member& member : members_) {
      if (member.subject.callbacks.empty()) known.threads.push_back(member.subject.name);
    }
  }
  report(misspelt_ids(*spec, known));
}

// --- watching ------------------------------------------------------------------------------------

std::vector<SchedulingProblem> ThreadConfigurator::audit(Member& member) {
  std::vector<SchedulingProblem> found;
  const auto reported = calls_.emit(*member.thread, SchedMoment::audit, 0);
  if (!reported) return found;
  auto now = differences(member.asked, *reported);
  if (now == member.told) return found;
  member.told = std::move(now);
  if (member.told.empty()) return found;  // somebody put it right
  std::string reason = "changed from outside: " + joined(member.told);
  const bool applies_again = options_.on_change == OnChange::apply_again;
  if (applies_again) reason += "; it is applied again";
  found.push_back(
      problem(member.spec.get(), member.entry, member.subject.name, 0, std::move(reason)));
  found.back().is_from_outside = true;
  if (!applies_again) return found;
  member.thread->begin_change();
  const auto problems = apply(member);
  found.insert(found.end(), problems.begin(), problems.end());
  return found;
}

void ThreadConfigurator::audit() {
  std::vector<SchedulingProblem> found;
  {
    const std::lock_guard lock{members_mutex_};
    drop_orphans();
    for (Member& member : members_) {
      const auto owner = member.owner ? member.owner->lock() : nullptr;
      if (member.owner && owner == nullptr) continue;
      const auto problems = audit(member);
      found.insert(found.end(), problems.begin(), problems.end());
    }
  }
  report(found);
}

void ThreadConfigurator::drop_orphans() {
  members_.remove_if([](const Member& member) { return member.owner && member.owner->expired(); });
}

// --- telling -------------------------------------------------------------------------------------

void ThreadConfigurator::report(const std::vector<SchedulingProblem>& problems) {
  const std::lock_guard lock{problems_mutex_};
  for (const SchedulingProblem& problem : problems) {
    problems_.push_back(problem);
    if (options_.on_scheduling_problem) options_.on_scheduling_problem(problem);
  }
}

void ThreadConfigurator::refuse_if_any(const std::vector<SchedulingProblem>& problems) const {
  if (!problems.empty() && options_.on_error == OnError::refuse) throw SchedulingRefused{problems};
}

std::vector<SchedulingProblem> ThreadConfigurator::problems() const {
  const std::lock_guard lock{problems_mutex_};
  return problems_;
}

std::string ThreadConfigurator::why_no_thread(int error) const {
  return scheduling::why_no_thread(error, kernel_);
}

}  // namespace cie::scheduling
