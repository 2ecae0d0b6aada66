// Of instances that are no part of one window: which count all the same.
#include "instance_measurer.hpp"

namespace cie::analysis {

bool InstanceMeasurer::goes_on_in_next(const CoveredWindow& window,
                                       const PendingInstance& pending) const {
  const auto& next = recording_.window_of(pending.end->stream);
  return window.contains(pending.start.time, pending.start.time) && window.end && next.begin &&
         *next.begin <= *window.end && next.contains(pending.end->time, pending.end->time);
}

bool InstanceMeasurer::is_between_sessions(const PendingInstance& pending) const {
  return recording_.is_recorded_before(pending.stream, pending.start.time,
                                       *pending.process_facts) &&
         recording_.is_recorded_after(pending.end->stream, pending.end->time);
}

bool InstanceMeasurer::counts_outside(const CoveredWindow& window, const PendingInstance& pending) {
  if (goes_on_in_next(window, pending)) return true;
  if (!is_between_sessions(pending)) return false;
  const auto& facts = *pending.callback_facts;
  if (facts.is_accounted) return true;
  recording_.note_between_sessions(facts.process, pending.start, pending.end->time);
  return false;
}

bool InstanceMeasurer::is_outside(const CoveredWindow& window,
                                  const PendingInstance& pending) const {
  const auto start = pending.start.time;
  if (!pending.callback_facts->is_accounted) {
    return pending.end ? window.excludes(start, pending.end->time)
                       : window.end && start > *window.end;
  }
  if (!recording_.is_recorded_after(pending.stream, start)) return true;
  return pending.end &&
         !recording_.is_recorded_before(pending.stream, pending.end->time, *pending.process_facts);
}

// Starts and ends without numbers may not belong together where a CPU is without a record, and a wake-up
// may not be the last one.
void InstanceMeasurer::note_outside(const PendingInstance& pending, const Measured& measured,
                                    bool has_part) {
  auto& facts = *pending.callback_facts;
  const auto end = pending.end ? pending.end->time : pending.start.time;
  const bool is_witness = pending.end && facts.is_accounted && !pending.may_be_another;
  if ((has_part && !is_witness) || !recording_.is_asked_for(pending.start.time, end)) return;
  auto& outside = facts.outside ? *facts.outside : facts.outside.emplace();
  if (!has_part) ++outside.count;
  if (!is_witness) return;
  const auto note = [&](auto& most, Duration value) {
    if (!most || most->value < value) most = extreme_of(pending, measured, value);
  };
  const bool is_exact = measured.release_source == ReleaseSource::exact;
  note(outside.max_response, end - (is_exact ? measured.release : pending.start.time));
  if (measured.parts != nullptr) note(outside.max_execution, measured.parts->execution);
  if (!is_exact) return;
  note_arrival_outside(facts, pending.callback,
                       {.seq = pending.seq,
                        .start = pending.start,
                        .end = *pending.end,
                        .release = measured.release});
}

void InstanceMeasurer::note_pair_outside(InstancesOutside& outside, const Arrival& one,
                                         const Arrival& other) {
  if (one.seq > other.seq) return note_pair_outside(outside, other, one);
  if (one.seq + 1 != other.seq) return;
  const auto gap = other.release - one.release;
  const auto keep = [&](auto& extreme) { extreme = extreme_of(other, other.release, gap); };
  auto& shortest = outside.min_inter_arrival;
  auto& longest = outside.max_inter_arrival;
  if (gap < Duration{}) {
    outside.is_reordered = true;
  } else if (!shortest || gap < shortest->value) {
    keep(shortest);
  }
  if (!longest || longest->value < gap) keep(longest);
  if (other.release <= one.end.time && !outside.release_before_end)
    outside.release_before_end = before_end(one, other);
}

void InstanceMeasurer::note_arrival_outside(CallbackFacts& facts, CallbackIndex callback,
                                            const Arrival& arrived) {
  const auto pair_with = [&](const Arrival& other) {
    note_pair_outside(*facts.outside, arrived, other);
  };
  if (auto* inside = arrivals_.find(callback)) {
    inside->lonely.for_each(pair_with);
    if (inside->has_latest) pair_with(inside->latest);
  }
  auto& others = arrivals_outside_[callback];
  others.for_each(pair_with);
  others.push(arrived);
}

void InstanceMeasurer::note_beside_outside(CallbackFacts& facts, CallbackIndex callback,
                                           const Arrival& arrived) {
  auto* others = arrivals_outside_.find(callback);
  if (others == nullptr) return;
  others->for_each(
      [&](const Arrival& other) { note_pair_outside(*facts.outside, arrived, other); });
}

}  // namespace cie::analysis
