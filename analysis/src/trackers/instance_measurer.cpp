#include "instance_measurer.hpp"

#include <cie/analysis/response_time.hpp>

#include "model/callback_questions.hpp"

#include <algorithm>
#include <span>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxPreemptors = 1024;

// From here on not every instance has its duration as what is certain of its response time.
void keep_lower_apart(CallbackFacts& facts) {
  if (!facts.is_lower_duration) return;
  facts.is_lower_duration = false;
  facts.response_time_lower = facts.duration;
}

// What a callback's instances were preempted by, as long as that is not everything of the machine.
void note_preemptors(CallbackFacts& facts, std::span<const Preemptor> preemptors) {
  if (preemptors.empty()) return;
  auto& all = facts.preempted_by ? *facts.preempted_by : facts.preempted_by.emplace();
  for (const auto& preemptor : preemptors) {
    const auto found = all.find(preemptor.tid);
    if (found != all.end()) {
      found->second.time += preemptor.time;
      found->second.in_callbacks += preemptor.in_callbacks;
    } else if (preemptor.is_idle() || all.size() < kMaxPreemptors) {
      all.emplace(preemptor.tid, preemptor);
    }
  }
}

// For how long those ran that did not run a callback then.
Duration outside_callbacks(std::span<const Preemptor> preemptors) {
  Duration sum{};
  for (const auto& preemptor : preemptors)
    sum += preemptor.time - preemptor.in_callbacks;
  return sum;
}

}  // namespace

inline bool InstanceMeasurer::is_isolated_thread(const PendingInstance& pending) const {
  return pending.thread_facts != nullptr && pending.thread_facts->role == ThreadRole::callback;
}

// A wake-up stands in the record of the CPU that woke the thread, which may be any.
inline bool InstanceMeasurer::is_woken_last(const PendingInstance& pending) const {
  if (!pending.wake.waking) return false;
  const auto window = recording_.kernel_window(pending.host, pending.start.time);
  const auto woken = pending.wake.since ? pending.wake.since : OptionalTime(window.begin);
  return woken && recording_.coverage().covers_all(pending.host) &&
         window.contains(*woken, pending.start.time) &&
         !timeline_.overlaps_hole(pending.host, *woken, pending.start.time);
}

// Its message, as far as is known: another one woke the thread, and was overwritten. Readings of the
// clocks differ.
inline bool InstanceMeasurer::may_be_written_after(const PendingInstance& pending,
                                                   Timestamp time) const {
  if (pending.source_timestamp <= 0) return false;
  const auto written = source_time(pending);
  return !written || *written > time + HostClocks::kLeastStep;
}

// The first sign of its release: of a thread that waited again for something else that is the nearer
// one. Of the kernel's only what a thread_wakeup followed: others ended no wait of the executor but
// one for a lock, say. Empty: there is none that is not of an instance which nobody saw, or of another
// message.
inline OptionalTime InstanceMeasurer::woken(const PendingInstance& pending,
                                            const Measured& measured) const {
  const auto its_own = [&pending](const OptionalTime& wake) {
    return wake && pending.alone_since && *wake >= *pending.alone_since ? wake : OptionalTime{};
  };
  const auto waking = its_own(measured.waking);
  const auto wakeup = its_own(pending.wakeup);
  if (!wakeup) return wakeup;
  const auto woken = waking ? std::min(*waking, *wakeup) : *wakeup;
  return may_be_written_after(pending, woken) ? OptionalTime{} : OptionalTime(woken);
}

inline void InstanceMeasurer::find_release(const PendingInstance& pending,
                                           Measured& measured) const {
  if (pending.release) {
    measured.release = *pending.release;
    measured.release_source = ReleaseSource::exact;
  } else if (pending.expiry && !pending.callback_facts->grid.is_refuted) {
    if (is_unproven(pending)) {
      measured.unproven = pending.expiry;
      measured.release = pending.start.time;
      return;
    }
    measured.release = *pending.expiry;
    measured.release_source = ReleaseSource::timer_grid;
  } else if (const auto wake =
                 is_isolated_thread(pending) ? woken(pending, measured) : OptionalTime{}) {
    measured.release = *wake;
    measured.release_source = ReleaseSource::wakeup;
  } else if (const auto written = source_time(pending)) {
    measured.release = *written;
    measured.release_source = ReleaseSource::source_timestamp;
  } else {
    measured.release = pending.start.time;
    measured.release_source = ReleaseSource::start;
  }
}

inline InstanceMeasurer::Measured InstanceMeasurer::measured(const PendingInstance& pending,
                                                             bool is_inside) const {
  Measured measured;
  if (is_woken_last(pending)) measured.waking = pending.wake.waking;
  find_release(pending, measured);
  if (!pending.end) {
    measured.state = InstanceState::open;
    return measured;
  }
  if (!is_inside) measured.state = InstanceState::cut_by_window;
  const bool is_measured =
      pending.parts && model_.hosts[at(pending.host)].has_switches && is_recorded(pending) &&
      (pending.parts->presumption == 0 ||
       timeline_.is_proven(pending.host, *pending.end->tid, pending.parts->presumption));
  if (is_measured) {
    const auto& parts = *pending.parts;
    measured.parts = &parts;
    measured.preempted_by = pending.preempted_by;
    const auto waiting = pending.end->time - pending.start.time - parts.execution - parts.preempted;
    // Who woke it may have done so on a CPU without a record.
    measured.has_wake_parts =
        parts.blocked && parts.wake_delay &&
        (waiting <= Duration{} || recording_.coverage().covers_all(pending.host));
  }
  return measured;
}

bool InstanceMeasurer::is_left(const PendingInstance& pending) const {
  const auto& until = pending.left_before;
  return until && !recording_.loss_times().any_between(pending.host, pending.start.time, *until);
}

void InstanceMeasurer::prefetch(const PendingInstance& pending) const noexcept {
  const auto& facts = *pending.callback_facts;
  for (const auto* quantity :
       {&facts.response_time, &facts.start_latency, &facts.duration, &facts.inter_arrival}) {
    prefetch_place(quantity->next_place());
  }
  if (pending.wakeup)
    return;  // what is told by the callback alone was said when the thread woke up
  prefetch_to_write(bounds_.find(pending.callback));
  if (facts.exact_instances > 0) prefetch_to_write(arrivals_.find(pending.callback));
}

void InstanceMeasurer::measure(const PendingInstance& pending) {
  const auto& window = recording_.window_of(pending.stream);
  bool is_inside = pending.end && window.contains(pending.start.time, pending.end->time);
  if (!is_inside && pending.end) [[unlikely]]
    is_inside = counts_outside(window, pending);
  const bool has_part = is_inside || !is_outside(window, pending);
  const auto measured = this->measured(pending, is_inside);
  if (!is_inside) [[unlikely]]
    note_outside(pending, measured, has_part);
  if (!has_part) [[unlikely]]
    return;
  auto& facts = *pending.callback_facts;
  switch (measured.state) {
    case InstanceState::complete:
      count(pending, measured);
      if (pending.node) chains_.on_complete(*pending.node, *pending.end);
      break;
    case InstanceState::cut_by_window:
      ++facts.cut_instances;
      note_unmeasured(facts, pending.end->time - pending.start.time);
      break;
    case InstanceState::open:
      ++facts.open_count;
      if (facts.open.size() < kMaxOpenListed) {
        auto& open = facts.open.emplace_back(open_instance(pending));
        open.is_left = is_left(pending);
        const bool is_measured =
            pending.measured_to && pending.parts && model_.hosts[at(pending.host)].has_switches;
        if (is_measured && is_recorded(pending))
          open.executed = {pending.parts->execution, *pending.measured_to};
        if (open.release_exact && pending.is_in_window) note_open_arrival(pending, open);
      }
      break;
  }
  if (observer_ == nullptr) return;
  if (measured.unproven && observer_->waits_for_proof()) [[unlikely]] {
    hold_back(pending, measured);
  } else {
    observer_->on_instance(instance_of(pending, measured));
  }
}

[[gnu::always_inline]] inline void InstanceMeasurer::count(const PendingInstance& pending,
                                                           const Measured& measured) {
  auto& facts = *pending.callback_facts;
  ++facts.instances;
  const auto source = measured.release_source;
  ++facts.by_release_source[static_cast<std::size_t>(source)];
  if (pending.source_timestamp != 0 || pending.writer_gid != 0) ++facts.messages_told;
  const auto start = pending.start.time;
  const auto end = pending.end->time;
  if (facts.response_deadline &&
      least_response_time(source, measured.release, start, end) > *facts.response_deadline) {
    ++facts.late;
    if (end - start > *facts.response_deadline) ++facts.late_by_duration;
  }
  if (!pending.status) ++facts.without_status;
  if (pending.status == CallbackStatus::exception) {
    ++facts.exceptions;
    if (!facts.first_exception) facts.first_exception = {pending.seq, *pending.end};
  }
  if (pending.pair != nullptr) ++pending.pair->instances;
  auto& bounds = bounds_[pending.callback];
  note_response_time(pending, measured, bounds);
  if (is_known(source)) {
    const auto arrival = [&] {
      return Arrival{.seq = pending.seq,
                     .start = pending.start,
                     .end = *pending.end,
                     .release = measured.release};
    };
    const auto arrived = arrival();
    note_known(facts, bounds, arrived, measured);
    auto& arrivals = note_arrival(facts, pending.callback, pending.host, arrived, bounds);
    arrivals.latest = arrival();  // written where it stays: a copy of its parts would have to wait
  } else if (measured.unproven) [[unlikely]] {
    keep_unproven(pending.callback, pending.host,
                  {.seq = pending.seq,
                   .start = pending.start,
                   .end = *pending.end,
                   .release = *measured.unproven});
  }
  note_parts(pending, measured, bounds);
  if (facts.own && !pending.may_be_another) [[unlikely]]
    note_own(pending, measured, *facts.own);
}

// What is certain of its response time. A calculated release may have been later.
inline Duration InstanceMeasurer::least_response(const PendingInstance& pending,
                                                 const Measured& measured) {
  const auto start = pending.start.time;
  const auto end = pending.end->time;
  return measured.release_source == ReleaseSource::timer_grid
             ? end - start
             : least_response_time(measured.release_source, measured.release, start, end);
}

void InstanceMeasurer::note_own(const PendingInstance& pending, const Measured& measured,
                                OwnInstances& own) {
  const auto note = [&](auto& most, Duration value) {
    if (!most || most->value < value) most = extreme_of(pending, measured, value);
  };
  note(own.max_response_lower, least_response(pending, measured));
  if (is_known(measured.release_source)) {
    note(own.max_response, pending.end->time - measured.release);
  }
  if (measured.parts != nullptr) note(own.max_execution, measured.parts->execution);
}

[[gnu::always_inline]] inline void InstanceMeasurer::note_known(CallbackFacts& facts,
                                                                Bounds& bounds,
                                                                const Arrival& instance,
                                                                const Measured& measured) {
  keep_lower_apart(facts);
  ++facts.exact_instances;
  const auto response = instance.end.time - instance.release;
  const auto start_latency = instance.start.time - instance.release;
  facts.response_time.add(response);
  facts.start_latency.add(start_latency);
  if (bounds.response.rise(response)) {
    facts.max_response = extreme_of(instance, instance.release, response);
    facts.max_response_parts = {.start_latency = start_latency};
    if (measured.parts != nullptr) {
      facts.max_response_parts.preempted = measured.parts->preempted;
      facts.max_response_parts.preempted_outside = outside_callbacks(measured.preempted_by);
    }
    if (measured.has_wake_parts) facts.max_response_parts.wake_delay = measured.parts->wake_delay;
  }
  if (bounds.response_upper.rise(response)) {
    facts.max_response_upper = extreme_of(instance, instance.release, response);
  }
}

void InstanceMeasurer::keep_unproven(CallbackIndex index, HostIndex host, const Arrival& instance) {
  auto& facts = model_.callbacks[at(index)];
  auto& unproven = unproven_[index];
  if (unproven.instances.size() >= Unproven::kMost) leave_bounds(index);
  keep_lower_apart(facts);
  ++facts.without_upper_bound;
  unproven.host = host;
  unproven.instances.push_back(instance);
}

void InstanceMeasurer::count_unproven(CallbackIndex index, Unproven& unproven) {
  auto& facts = model_.callbacks[at(index)];
  auto& bounds = bounds_[index];
  for (auto& instance : unproven.instances) {
    const auto start = instance.start.time;
    const auto end = instance.end.time;
    --facts.by_release_source[static_cast<std::size_t>(ReleaseSource::start)];
    ++facts.by_release_source[static_cast<std::size_t>(ReleaseSource::timer_grid)];
    --facts.without_upper_bound;
    if (facts.response_deadline && end - start <= *facts.response_deadline &&
        least_response_time(ReleaseSource::timer_grid, instance.release, start, end) >
            *facts.response_deadline) {
      ++facts.late;
    }
    for (auto* extreme : longest_of(facts)) {
      if (extreme == nullptr || extreme->seq != instance.seq) continue;
      extreme->release = instance.release;
      extreme->release_source = ReleaseSource::timer_grid;
    }
    note_known(facts, bounds, instance, {});
    note_arrival(facts, index, unproven.host, instance, bounds).latest = instance;
  }
  unproven.instances.clear();
}

[[gnu::always_inline]] inline void InstanceMeasurer::note_response_time(
    const PendingInstance& pending, const Measured& measured, Bounds& bounds) {
  auto& facts = *pending.callback_facts;
  const auto [source, release] = std::pair(measured.release_source, measured.release);
  const auto start = pending.start.time;
  const auto end = pending.end->time;
  const auto lower = least_response(pending, measured);
  if (bounds.response_lower.rise(lower)) {
    facts.max_response_lower = extreme_of(pending, measured, lower);
  }
  if (!is_known(source) && !measured.unproven) {
    if (lower != end - start) keep_lower_apart(facts);
    if (!facts.is_lower_duration) facts.response_time_lower.add(lower);
    if (const auto written = bound_of_release(pending)) {
      note_bounded(pending, measured, *written, bounds);
    } else {
      ++facts.without_upper_bound;
      if (is_clock_set_meanwhile(pending)) ++facts.with_doubtful_bound;
    }
  }
}

[[gnu::always_inline]] inline void InstanceMeasurer::note_parts(const PendingInstance& pending,
                                                                const Measured& measured,
                                                                Bounds& bounds) {
  auto& facts = *pending.callback_facts;
  const auto duration = pending.end->time - pending.start.time;
  facts.duration.add(duration);
  if (bounds.duration.rise(duration)) {
    facts.max_duration = extreme_of(pending, measured, duration);
  }
  if (const auto* parts = measured.parts) {
    facts.execution_time.add(parts->execution);
    facts.preempted.add(parts->preempted);
    note_preemptors(facts, pending.preempted_by);
    facts.max_preempted_outside = std::max(facts.max_preempted_outside.value_or(Duration{}),
                                           outside_callbacks(pending.preempted_by));
    if (bounds.execution.rise(parts->execution)) {
      facts.max_execution = extreme_of(pending, measured, parts->execution);
    }
    if (measured.has_wake_parts) {
      facts.blocked.add(*parts->blocked);
      facts.wake_delay.add(*parts->wake_delay);
      const auto sum = parts->execution + parts->preempted + *parts->blocked + *parts->wake_delay;
      if (sum != duration) ++facts.identity_failures;
    } else {
      note_unmeasured(facts, duration - parts->preempted);
    }
  } else {
    if (bounds.duration_without_execution.rise(duration)) {
      facts.max_duration_without_execution = extreme_of(pending, measured, duration);
      note_unmeasured(facts, duration);
    }
  }
  if (measured.waking && pending.wake.first_in) {
    facts.wakeup_latency.add(*pending.wake.first_in - *measured.waking);
  }
}

// If their numbers are: those of ROS 2's events are counted, and do not tell of what was lost.
inline bool InstanceMeasurer::are_in_a_row(const CallbackFacts& facts, HostIndex host,
                                           const Arrival& one, const Arrival& other) const {
  return facts.is_accounted ||
         !recording_.loss_times().any_between(host, other.start.time, one.start.time);
}

void InstanceMeasurer::note_gap(CallbackFacts& facts, Bounds& bounds, Duration gap,
                                const Arrival& later) {
  facts.inter_arrival.add(gap);
  note_extremes(facts, bounds, gap, later);
}

inline void InstanceMeasurer::note_extremes(CallbackFacts& facts, Bounds& bounds, Duration gap,
                                            const Arrival& later) {
  const auto extreme = [&later, gap] {
    return Extreme<Duration>{.value = gap,
                             .seq = later.seq,
                             .start = later.start,
                             .end = later.end,
                             .release = later.release};
  };
  if (gap < Duration{}) {
    facts.is_reordered = true;
  } else if (bounds.min_inter_arrival.fall(gap)) {
    facts.min_inter_arrival = extreme();
  }
  if (bounds.max_inter_arrival.rise(gap)) facts.max_inter_arrival = extreme();
}

void InstanceMeasurer::note_open_arrival(const PendingInstance& pending, OpenInstance& open) {
  auto& facts = *pending.callback_facts;
  auto& bounds = bounds_[pending.callback];
  const Arrival begun{
      .seq = pending.seq, .start = pending.start, .end = pending.start, .release = *open.release};
  const auto pair_with = [&](const Arrival& other) {
    if (!are_in_a_row(facts, pending.host, begun, other)) return;
    if (other.seq + 1 == begun.seq) {
      note_extremes(facts, bounds, begun.release - other.release, begun);
      note_release_before_end(facts, other, begun);
    }
    if (begun.seq + 1 == other.seq) {
      note_extremes(facts, bounds, other.release - begun.release, other);
      open.next_release = other.release;
      open.next_start = other.start;
    }
  };
  auto& arrivals = arrivals_[pending.callback];
  arrivals.lonely.for_each(pair_with);
  if (arrivals.has_latest) pair_with(arrivals.latest);
  if (auto* outside = arrivals_outside_.find(pending.callback)) outside->for_each(pair_with);
}

inline void InstanceMeasurer::note_release_before_end(CallbackFacts& facts, const Arrival& earlier,
                                                      const Arrival& later) {
  const bool is_after_end = later.release > earlier.end.time;
  if (is_after_end || facts.release_before_end || facts.has_grid_releases()) return;
  facts.release_before_end = before_end(earlier, later);
}

void InstanceMeasurer::note_pair(CallbackFacts& facts, Bounds& bounds, const Arrival& earlier,
                                 const Arrival& later) {
  note_gap(facts, bounds, later.release - earlier.release, later);
  note_release_before_end(facts, earlier, later);
}

[[gnu::always_inline]] inline InstanceMeasurer::Arrivals& InstanceMeasurer::note_arrival(
    CallbackFacts& facts, CallbackIndex callback, HostIndex host, const Arrival& arrived,
    Bounds& bounds) {
  auto& arrivals = arrivals_[callback];
  bool has_previous = false;
  bool has_next = false;
  const auto pair_with = [&](const Arrival& other) {
    if (!are_in_a_row(facts, host, arrived, other)) return;
    if (other.seq + 1 == arrived.seq) {
      note_pair(facts, bounds, other, arrived);
      has_previous = true;
    }
    if (arrived.seq + 1 == other.seq) {
      note_pair(facts, bounds, arrived, other);
      has_next = true;
    }
  };
  const bool may_fill_a_hole =
      arrivals.lonely.size() > 0 &&
      (arrived.seq <= arrivals.last_lonely || arrived.seq - 1 == arrivals.last_lonely);
  if (may_fill_a_hole) arrivals.lonely.for_each(pair_with);
  if (arrivals.has_latest) {
    const bool has_other_previous = std::exchange(has_previous, false);
    const bool has_other_next = std::exchange(has_next, false);
    pair_with(arrivals.latest);
    const bool has_both =
        (arrivals.has_previous || has_next) && (arrivals.has_next || has_previous);
    if (!has_both) {
      arrivals.last_lonely = std::max(arrivals.last_lonely, arrivals.latest.seq);
      arrivals.lonely.push(arrivals.latest);
    }
    has_previous = has_previous || has_other_previous;
    has_next = has_next || has_other_next;
  }
  if (!has_previous && facts.outside) [[unlikely]]
    note_beside_outside(facts, callback, arrived);
  arrivals.has_latest = true;
  arrivals.has_previous = has_previous;
  arrivals.has_next = has_next;
  return arrivals;
}

}  // namespace cie::analysis
