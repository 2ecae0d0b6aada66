#include "instance_measurer.hpp"

#include <cie/analysis/deadline.hpp>

#include <algorithm>
#include <span>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxOpenListed = 64;
constexpr std::size_t kMaxPreemptors = 1024;

Extreme<Duration> extreme_of(const auto& instance, Timestamp release, Duration value) {
  return {.value = value,
          .seq = instance.seq,
          .start = instance.start,
          .end = instance.end,
          .release = release};
}

// From here on not every instance has its duration as what is certain of its response time.
void keep_lower_apart(CallbackFacts& facts) {
  if (!facts.is_lower_duration) return;
  facts.is_lower_duration = false;
  facts.response_time_lower = facts.duration;
}

void note_unmeasured(CallbackFacts& facts, Duration most) {
  facts.longest_unmeasured = std::max(facts.longest_unmeasured.value_or(most), most);
}

// What a callback's instances were preempted by, as long as that is not everything of the machine.
void note_preemptors(CallbackFacts& facts, std::span<const Preemptor> preemptors) {
  for (const auto& preemptor : preemptors) {
    const auto found = facts.preempted_by.find(preemptor.tid);
    if (found != facts.preempted_by.end()) {
      found->second.time += preemptor.time;
    } else if (facts.preempted_by.size() < kMaxPreemptors) {
      facts.preempted_by.emplace(preemptor.tid, preemptor);
    }
  }
}

}  // namespace

inline bool InstanceMeasurer::is_isolated_thread(const LiveInstance& live) const {
  return live.thread_facts != nullptr && live.thread_facts->role == ThreadRole::callback;
}

bool InstanceMeasurer::is_recorded(const LiveInstance& live) const {
  const auto begin = live.start.time;
  const auto end = live.end->time;
  const auto& coverage = recording_.coverage();
  if (!live.parts->has_left && live.start.cpu) {  // then no other CPU matters
    const std::optional<std::int32_t> cpu = live.start.cpu;
    return recording_.kernel_window(live.host, begin, cpu).contains(begin, end) &&
           coverage.covers(live.host, *live.start.cpu) &&
           !timeline_.overlaps_hole(live.host, begin, end, live.start.cpu);
  }
  return recording_.kernel_window(live.host, begin).contains(begin, end) &&
         (live.is_confined || coverage.covers_all(live.host)) &&
         !timeline_.overlaps_hole(live.host, begin, end);
}

// A wake-up stands in the record of the CPU that woke the thread, which may be any.
inline bool InstanceMeasurer::is_woken_last(const LiveInstance& live) const {
  if (!live.wake.waking) return false;
  const auto window = recording_.kernel_window(live.host, live.start.time);
  const auto woken = live.wake.since ? live.wake.since : OptionalTime(window.begin);
  return woken && recording_.coverage().covers_all(live.host) &&
         window.contains(*woken, live.start.time) &&
         !timeline_.overlaps_hole(live.host, *woken, live.start.time);
}

// The first sign of its release: of a thread that waited again for something else that is the nearer
// one. Empty: there is none that is not of an instance which nobody saw.
inline OptionalTime InstanceMeasurer::woken(const LiveInstance& live, const Measured& measured) {
  const auto its_own = [&live](const OptionalTime& wake) {
    return wake && live.alone_since && *wake >= *live.alone_since ? wake : OptionalTime{};
  };
  const auto waking = its_own(measured.waking);
  const auto wakeup = its_own(live.wakeup);
  if (!waking || !wakeup) return waking ? waking : wakeup;
  return std::min(*waking, *wakeup);
}

inline void InstanceMeasurer::find_release(const LiveInstance& live, Measured& measured) const {
  if (live.release) {
    measured.release = *live.release;
    measured.release_source = ReleaseSource::exact;
  } else if (live.expiry && !live.callback_facts->grid.is_refuted) {
    if (is_unproven(live)) {
      measured.unproven = live.expiry;
      measured.release = live.start.time;
      return;
    }
    measured.release = *live.expiry;
    measured.release_source = ReleaseSource::timer_grid;
  } else if (const auto wake = is_isolated_thread(live) ? woken(live, measured) : OptionalTime{}) {
    measured.release = *wake;
    measured.release_source = ReleaseSource::wakeup;
  } else if (const auto written = source_time(live)) {
    measured.release = *written;
    measured.release_source = ReleaseSource::source_timestamp;
  } else {
    measured.release = live.start.time;
    measured.release_source = ReleaseSource::start;
  }
}

inline InstanceMeasurer::Measured InstanceMeasurer::measured(const LiveInstance& live,
                                                             bool is_inside) const {
  Measured measured;
  if (is_woken_last(live)) measured.waking = live.wake.waking;
  find_release(live, measured);
  if (!live.end) {
    measured.state = InstanceState::open;
    return measured;
  }
  if (!is_inside) measured.state = InstanceState::cut_by_window;
  if (live.parts && model_.hosts[at(live.host)].has_switches && is_recorded(live)) {
    const auto& parts = *live.parts;
    measured.parts = &parts;
    const auto waiting = live.end->time - live.start.time - parts.execution - parts.preempted;
    // Who woke it may have done so on a CPU without a record.
    measured.has_wake_parts =
        parts.blocked && parts.wake_delay &&
        (waiting <= Duration{} || recording_.coverage().covers_all(live.host));
  }
  return measured;
}

Instance InstanceMeasurer::instance_of(const LiveInstance& live, const Measured& measured) const {
  const auto& facts = *live.callback_facts;
  Instance instance;
  if (facts.registered) instance.logical_id = facts.logical_id;
  instance.callback = live.callback;
  instance.process = facts.process;
  instance.pid = live.start.pid.value_or(-1);
  instance.tid = live.start.tid.value_or(-1);
  instance.seq = live.seq;
  instance.state = measured.state;
  instance.status = live.status;
  instance.release = measured.release;
  instance.release_source = measured.release_source;
  instance.wakeup = live.wakeup;
  instance.waking = measured.waking;
  instance.start = live.start.time;
  if (live.end) instance.end = live.end->time;
  instance.cpu_start = live.start.cpu;
  if (live.end) instance.cpu_end = live.end->cpu;
  if (measured.parts) {
    instance.execution = measured.parts->execution;
    instance.preempted = measured.parts->preempted;
    if (measured.has_wake_parts) {
      instance.blocked = measured.parts->blocked;
      instance.wake_delay = measured.parts->wake_delay;
    }
    instance.preempted_by = live.preempted_by;
  }
  if (facts.kind == CallbackKind::timer) {
    const bool is_told =
        live.is_missed_known && (facts.is_accounted || is_known(instance.release_source));
    instance.missed = is_told ? std::optional(live.missed) : std::nullopt;
  }
  instance.response_deadline = facts.response_deadline;
  instance.source_timestamp_realtime_ns = std::max<std::int64_t>(live.source_timestamp, 0);
  instance.writer_gid = live.writer_gid;
  instance.host = live.host;
  return instance;
}

void InstanceMeasurer::prefetch(const LiveInstance& live) const noexcept {
  const auto& facts = *live.callback_facts;
  for (const auto* quantity :
       {&facts.response_time, &facts.start_latency, &facts.duration, &facts.inter_arrival}) {
    quantity->prefetch();
  }
  if (live.wakeup) return;  // what is told by the callback alone was said when the thread woke up
  prefetch_to_write(bounds_.find(live.callback));
  if (facts.exact_instances > 0) prefetch_to_write(arrivals_.find(live.callback));
}

void InstanceMeasurer::measure(const LiveInstance& live) {
  const auto& window = recording_.window_of(live.stream);
  const bool is_inside = live.end && window.contains(live.start.time, live.end->time);
  if (!is_inside) [[unlikely]] {
    if (live.end && window.excludes(live.start.time, live.end->time)) return;
    if (!live.end && window.end && live.start.time > *window.end) return;
  }
  const auto measured = this->measured(live, is_inside);
  auto& facts = *live.callback_facts;
  switch (measured.state) {
    case InstanceState::complete:
      count(live, measured);
      if (live.node) chains_.on_complete(*live.node, *live.end);
      break;
    case InstanceState::cut_by_window:
      ++facts.cut_instances;
      note_unmeasured(facts, live.end->time - live.start.time);
      break;
    case InstanceState::open:
      ++facts.open_count;
      if (facts.open.size() < kMaxOpenListed) {
        auto& open = facts.open.emplace_back(
            OpenInstance{.start = live.start,
                         .seq = live.seq,
                         .release = measured.release,
                         .release_exact = measured.release_source == ReleaseSource::exact,
                         .missed = live.missed,
                         .thread = live.thread.value_or(ThreadIndex{kNoId}),
                         .next_release = std::nullopt});
        if (open.release_exact && live.is_in_window) note_open_arrival(live, open);
      }
      break;
  }
  if (observer_ == nullptr) return;
  if (measured.unproven && observer_->waits_for_proof()) [[unlikely]] {
    hold_back(live, measured);
  } else {
    observer_->on_instance(instance_of(live, measured));
  }
}

[[gnu::always_inline]] inline void InstanceMeasurer::count(const LiveInstance& live,
                                                           const Measured& measured) {
  auto& facts = *live.callback_facts;
  ++facts.instances;
  const auto source = measured.release_source;
  ++facts.by_release_source[static_cast<std::size_t>(source)];
  if (live.source_timestamp != 0 || live.writer_gid != 0) ++facts.messages_told;
  const auto start = live.start.time;
  const auto end = live.end->time;
  if (facts.response_deadline &&
      least_response_time(source, measured.release, start, end) > *facts.response_deadline) {
    ++facts.late;
    if (end - start > *facts.response_deadline) ++facts.late_by_duration;
  }
  if (!live.status) ++facts.without_status;
  if (live.status == CallbackStatus::exception) {
    ++facts.exceptions;
    if (!facts.first_exception) facts.first_exception = {live.seq, *live.end};
  }
  if (live.pair != nullptr) ++live.pair->instances;
  auto& bounds = bounds_[live.callback];
  note_response_time(live, measured, bounds);
  if (is_known(source)) {
    Arrival instance{
        .seq = live.seq, .start = live.start, .end = *live.end, .release = measured.release};
    note_known(facts, bounds, instance, measured);
    note_arrival(facts, live.callback, live.host, instance, bounds);
  } else if (measured.unproven) [[unlikely]] {
    keep_unproven(
        live.callback, live.host,
        {.seq = live.seq, .start = live.start, .end = *live.end, .release = *measured.unproven});
  }
  note_parts(live, measured, bounds);
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
    if (measured.parts != nullptr) facts.max_response_parts.preempted = measured.parts->preempted;
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
      if (*extreme && (*extreme)->seq == instance.seq) (*extreme)->release = instance.release;
    }
    note_known(facts, bounds, instance, {});
    note_arrival(facts, index, unproven.host, instance, bounds);
  }
  unproven.instances.clear();
}

[[gnu::always_inline]] inline void InstanceMeasurer::note_response_time(const LiveInstance& live,
                                                                        const Measured& measured,
                                                                        Bounds& bounds) {
  auto& facts = *live.callback_facts;
  const auto [source, release] = std::pair(measured.release_source, measured.release);
  const auto start = live.start.time;
  const auto end = live.end->time;
  const bool is_calculated = source == ReleaseSource::timer_grid;
  const auto lower = is_calculated ? end - start : least_response_time(source, release, start, end);
  if (bounds.response_lower.rise(lower)) {
    facts.max_response_lower = extreme_of(live, release, lower);
  }
  if (!is_known(source) && !measured.unproven) {
    if (lower != end - start) keep_lower_apart(facts);
    if (!facts.is_lower_duration) facts.response_time_lower.add(lower);
    if (const auto written = bound_of_release(live)) {
      note_bounded(live, measured, *written, bounds);
    } else {
      ++facts.without_upper_bound;
      if (is_clock_set_meanwhile(live)) ++facts.with_doubtful_bound;
    }
  }
}

void InstanceMeasurer::note_bounded(const LiveInstance& live, const Measured& measured,
                                    Timestamp written, Bounds& bounds) {
  auto& facts = *live.callback_facts;
  if (live.node) live.node->earliest = written;
  const auto upper = extreme_of(live, measured.release, live.end->time - written);
  auto& bounded = bounded_[live.host];
  // Of ROS 2 the messages show it themselves.
  if (!facts.is_accounted || clocks_.were_read_since(live.host, live.start.time) ||
      bounded.size() >= kMostBounded) {
    note_upper(facts, bounds, upper);
    return;
  }
  bounded.push_back(
      {.callback = live.callback, .source_timestamp = live.source_timestamp, .upper = upper});
}

[[gnu::always_inline]] inline void InstanceMeasurer::note_parts(const LiveInstance& live,
                                                                const Measured& measured,
                                                                Bounds& bounds) {
  auto& facts = *live.callback_facts;
  const auto duration = live.end->time - live.start.time;
  facts.duration.add(duration);
  if (bounds.duration.rise(duration)) {
    facts.max_duration = extreme_of(live, measured.release, duration);
  }
  if (const auto* parts = measured.parts) {
    facts.execution_time.add(parts->execution);
    facts.preempted.add(parts->preempted);
    note_preemptors(facts, live.preempted_by);
    if (bounds.execution.rise(parts->execution)) {
      facts.max_execution = extreme_of(live, measured.release, parts->execution);
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
      facts.max_duration_without_execution = extreme_of(live, measured.release, duration);
      note_unmeasured(facts, duration);
    }
  }
  if (measured.waking && live.wake.first_in) {
    facts.wakeup_latency.add(*live.wake.first_in - *measured.waking);
  }
}

// If their numbers are: those of ROS 2's events are counted, and do not tell of what was lost.
inline bool InstanceMeasurer::are_in_a_row(const CallbackFacts& facts, HostIndex host,
                                           const Arrival& one, const Arrival& other) const {
  return facts.is_accounted ||
         !recording_.user_losses().any_between(host, other.start.time, one.start.time);
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

void InstanceMeasurer::note_open_arrival(const LiveInstance& live, OpenInstance& open) {
  auto& facts = *live.callback_facts;
  auto& bounds = bounds_[live.callback];
  const Arrival begun{
      .seq = live.seq, .start = live.start, .end = live.start, .release = *open.release};
  const auto pair_with = [&](const Arrival& other) {
    if (!are_in_a_row(facts, live.host, begun, other)) return;
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
  auto& arrivals = arrivals_[live.callback];
  arrivals.lonely.for_each(pair_with);
  if (arrivals.has_latest) pair_with(arrivals.latest);
}

inline void InstanceMeasurer::note_release_before_end(CallbackFacts& facts, const Arrival& earlier,
                                                      const Arrival& later) {
  const bool is_after_end = later.release > earlier.end.time;
  if (is_after_end || facts.release_before_end || facts.has_grid_releases()) return;
  facts.release_before_end = CallbackFacts::ReleaseBeforeEnd{.seq = earlier.seq,
                                                             .start = earlier.start,
                                                             .end = earlier.end,
                                                             .next_release = later.release,
                                                             .next_start = later.start};
}

void InstanceMeasurer::note_pair(CallbackFacts& facts, Bounds& bounds, const Arrival& earlier,
                                 const Arrival& later) {
  note_gap(facts, bounds, later.release - earlier.release, later);
  note_release_before_end(facts, earlier, later);
}

[[gnu::always_inline]] inline void InstanceMeasurer::note_arrival(CallbackFacts& facts,
                                                                  CallbackIndex callback,
                                                                  HostIndex host, Arrival& arrived,
                                                                  Bounds& bounds) {
  auto& arrivals = arrivals_[callback];
  const auto pair = [&](Arrival& earlier, Arrival& later) {
    note_pair(facts, bounds, earlier, later);
    earlier.has_next = later.has_previous = true;
  };
  const auto pair_with = [&](Arrival& other) {
    if (!are_in_a_row(facts, host, arrived, other)) return;
    if (other.seq + 1 == arrived.seq) pair(other, arrived);
    if (arrived.seq + 1 == other.seq) pair(arrived, other);
  };
  const bool may_fill_a_hole =
      arrivals.lonely.size() > 0 &&
      (arrived.seq <= arrivals.last_lonely || arrived.seq - 1 == arrivals.last_lonely);
  if (may_fill_a_hole) arrivals.lonely.for_each(pair_with);
  if (arrivals.has_latest) {
    pair_with(arrivals.latest);
    if (!arrivals.latest.has_previous || !arrivals.latest.has_next) {
      arrivals.last_lonely = std::max(arrivals.last_lonely, arrivals.latest.seq);
      arrivals.lonely.push(arrivals.latest);
    }
  }
  arrivals.latest = arrived;
  arrivals.has_latest = true;
}

}  // namespace cie::analysis
