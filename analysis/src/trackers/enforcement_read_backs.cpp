// Read-backs: audits compared with what was applied before them.
#include "enforcement_tracker.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

// The audit has the slice and clamps that `wanted(field)` names, as far as both are known.
template <typename Wanted>
bool has_slice_and_clamps(const ReadBack& audit, const Wanted& wanted) {
  const auto is_same = [&](auto field) {
    const auto value = wanted(field);
    return !value || !(audit.*field) || audit.*field == value;
  };
  return is_same(&ReadBack::slice_ns) && is_same(&ReadBack::util_min) &&
         is_same(&ReadBack::util_max);
}

// Keeps the first audit that tells of a slice or clamp that it differs.
void note_slice_and_clamps(ThreadFacts& thread, const ReadBack& expected, const ReadBack& audit) {
  auto& known = thread.slice_or_clamp_mismatches;
  const auto differs = [](const ReadBack& one, const ReadBack& other, auto field) {
    return one.*field && other.*field && one.*field != other.*field;
  };
  const auto is_news = [&](auto field) {
    return differs(expected, audit, field) &&
           std::ranges::none_of(known, [&](const auto& mismatch) {
             return differs(mismatch.first, mismatch.second, field);
           });
  };
  if (is_news(&ReadBack::slice_ns) || is_news(&ReadBack::util_min) ||
      is_news(&ReadBack::util_max)) {
    known.emplace_back(expected, audit);
  }
}

// The kernel's own slices and clamps, which nobody asked for, may follow the number of CPUs.
bool is_kept(const ThreadFacts& thread, const ReadBack& expected, const ReadBack& audit) {
  return has_slice_and_clamps(audit,
                              [&](auto field) { return asked_for(thread, expected, field); });
}

// The last one then.
Rare<ReadBack> applied_before(const ThreadFacts& thread, Timestamp time) {
  const auto found =
      std::find_if(thread.applied.rbegin(), thread.applied.rend(),
                   [time](const ReadBack& applied) { return applied.at.time < time; });
  if (found == thread.applied.rend() || !is_in_force(thread, *found)) return {};
  return *found;
}

}  // namespace

const ReadBack* EnforcementTracker::first_audit_of_attached(const ThreadFacts& thread) const {
  const bool is_attached = model_.processes[at(thread.process)].first_moment == RunMoment::announce;
  return is_attached && thread.first_audit ? &*thread.first_audit : nullptr;
}

const ReadBack* EnforcementTracker::reference(const ThreadFacts& thread) const {
  return is_given_parameters(thread) ? &thread.applied.back() : first_audit_of_attached(thread);
}

void EnforcementTracker::on_read_back(const EventHead& head, ThreadIndex index,
                                      const ThreadSched& event) {
  auto& state = threads_[index];
  places_[index].cpu = event.cpus.empty() ? Place::kAnywhere : Place::kNotSeen;
  auto& thread = model_.threads[at(index)];
  if (!state.outside_initial.empty()) {
    // The one between the first and an audit that is not the next may come in the same nanosecond.
    const bool is_applied = event.moment == SchedMoment::applied;
    if (is_applied || event.n <= state.initial->n + 1) {
      judge_outside_initial(thread, state, is_applied);
    }
  }
  const auto* expected = reference(thread);
  if (expected != nullptr && event.n == expected->n) {  // from here on it is the reference
    const auto* tid = tids_[model_.processes[at(thread.process)].host].find(thread.tid);
    state.may_be_boosted = thread.is_known_to_kernel && tid != nullptr && tid->inheritance.told;
  }
  const bool is_configured = event.moment == SchedMoment::applied && thread.applied.size() == 1;
  if (is_configured) {  // what it did until then is none of its work
    forget_foreign_work(index);
  }
  compare_in_order(thread, state, read_back_of(head, event));
}

// Those of one nanosecond come in any order: each that follows has all of them compared anew.
void EnforcementTracker::compare_in_order(ThreadFacts& thread, OfThread& state,
                                          const ReadBack& read_back) {
  auto& now = state.compared;
  if (now && now->read_backs.front().at.time == read_back.at.time) {
    undo(thread, state);
  } else if (thread.last_read_back->n != read_back.n) {
    return;  // it was recorded after a newer one
  } else {
    now = Comparison{.read_backs = {},
                     .applied_before = applied_before(thread, read_back.at.time),
                     .was_changing = state.is_changing,
                     .audits_checked = thread.audits_checked,
                     .had_mismatch = static_cast<bool>(thread.audit_mismatch),
                     .slice_or_clamp_mismatches = thread.slice_or_clamp_mismatches.size()};
  }
  auto& all = now->read_backs;
  all.insert(std::ranges::upper_bound(all, read_back.n, {}, &ReadBack::n), read_back);
  const ReadBack* expected = now->applied_before ? &*now->applied_before : nullptr;
  for (const auto& read : all) {
    if (read.moment == SchedMoment::applied) {
      expected = &read;
      state.is_changing = false;
    } else if (read.moment == SchedMoment::audit && !state.is_changing) {
      const auto* reference = expected != nullptr ? expected : first_audit_of_attached(thread);
      if (reference != nullptr) compare(thread, state, *reference, read);
    }
  }
}

void EnforcementTracker::undo(ThreadFacts& thread, OfThread& state) {
  const auto& before = *state.compared;
  state.is_changing = before.was_changing;
  thread.audits_checked = before.audits_checked;
  if (!before.had_mismatch) thread.audit_mismatch.reset();
  auto& mismatches = thread.slice_or_clamp_mismatches;
  mismatches.erase(
      mismatches.begin() + static_cast<std::ptrdiff_t>(before.slice_or_clamp_mismatches),
      mismatches.end());
}

void EnforcementTracker::compare(ThreadFacts& thread, OfThread& state, const ReadBack& expected,
                                 const ReadBack& audit) {
  // The audit that announces a change is the last one to compare with what was applied before.
  state.is_changing = audit.change > expected.change;
  // The first audit of an attached process stands for what was applied: nothing is compared yet.
  const bool is_reference = thread.applied.empty() && audit.n == expected.n;
  if (!is_judging_ || is_reference) return;
  ++thread.audits_checked;
  const bool is_same = is_same_parameters(expected, audit) && is_kept(thread, expected, audit);
  if (!thread.audit_mismatch && !is_same) thread.audit_mismatch = {expected, audit};
  note_slice_and_clamps(thread, expected, audit);
}

void EnforcementTracker::on_later_audit(ThreadIndex index, const ReadBack& audit) {
  auto& thread = model_.threads[at(index)];
  const auto* expected = reference(thread);
  if (expected == nullptr || threads_[index].is_changing) return;
  if (is_same_parameters(*expected, audit) && is_kept(thread, *expected, audit)) {
    ++thread.audits_checked;
  }
}

}  // namespace cie::analysis
