#include "instance_measurer.hpp"

#include <cie/analysis/deadline.hpp>

#include "prefetch.hpp"

#include <algorithm>
#include <span>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxOpenListed = 64;
constexpr std::size_t kMaxPreemptors = 1024;

Extreme<Duration> extreme_of(const LiveInstance& live, const Instance& instance, Duration value) {
  return {.value = value,
          .seq = live.seq,
          .start = live.start,
          .end = live.end,
          .release = instance.release};
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

bool InstanceMeasurer::is_isolated_thread(const LiveInstance& live) const {
  return live.thread_facts != nullptr && live.thread_facts->role == ThreadRole::callback;
}

bool InstanceMeasurer::is_recorded(const LiveInstance& live) const {
  const auto begin = live.start.time;
  const auto end = live.end->time;
  const auto& coverage = recording_.coverage();
  if (!recording_.kernel_window(live.host).contains(begin, end)) return false;
  if (!live.parts->has_left && live.start.cpu) {  // then no other CPU matters
    return coverage.covers(live.host, *live.start.cpu) &&
           !timeline_.overlaps_hole(live.host, begin, end, live.start.cpu);
  }
  return (live.is_confined || coverage.covers_all(live.host)) &&
         !timeline_.overlaps_hole(live.host, begin, end);
}

// A wake-up stands in the record of the CPU that woke the thread, which may be any.
ThreadTimeline::Wake InstanceMeasurer::wake_of(const LiveInstance& live) const {
  if (!live.wake.waking) return {};
  const auto window = recording_.kernel_window(live.host);
  const auto woken = live.wake.since ? live.wake.since : window.begin;
  const bool is_last = woken && recording_.coverage().covers_all(live.host) &&
                       window.contains(*woken, live.start.time) &&
                       !timeline_.overlaps_hole(live.host, *woken, live.start.time);
  return is_last ? live.wake : ThreadTimeline::Wake{};
}

Instance InstanceMeasurer::instance_of(const LiveInstance& live) const {
  const auto& facts = *live.callback_facts;
  Instance instance;
  if (facts.registered) instance.logical_id = facts.logical_id;
  instance.callback = live.callback;
  instance.process = facts.process;
  instance.pid = live.start.pid.value_or(-1);
  instance.tid = live.start.tid.value_or(-1);
  instance.seq = live.seq;
  instance.status = live.status;
  instance.start = live.start.time;
  if (live.end) instance.end = live.end->time;
  instance.cpu_start = live.start.cpu;
  if (live.end) instance.cpu_end = live.end->cpu;
  instance.wakeup = live.wakeup;
  instance.waking = wake_of(live).waking;
  instance.response_deadline = facts.response_deadline;
  instance.missed = facts.kind == CallbackKind::timer ? live.missed : 0;
  instance.source_timestamp_realtime_ns = std::max<std::int64_t>(live.source_timestamp, 0);
  instance.writer_gid = live.writer_gid;
  instance.host = live.host;

  if (live.node->release) {
    instance.release = live.node->release;
    instance.release_source = ReleaseSource::exact;
  } else if (live.expiry && !facts.grid.is_refuted) {
    instance.release = live.expiry;
    instance.release_source = ReleaseSource::timer_grid;
  } else if (is_isolated_thread(live) && (instance.waking || live.wakeup)) {
    // Of a thread that waited again for something else the first sign is the nearer one.
    const bool is_woken_first =
        instance.waking && (!live.wakeup || *instance.waking <= *live.wakeup);
    instance.release = is_woken_first ? instance.waking : live.wakeup;
    instance.release_source = ReleaseSource::wakeup;
  } else if (const auto written = source_time(live)) {
    instance.release = written;
    instance.release_source = ReleaseSource::source_timestamp;
  } else {
    instance.release = live.start.time;
    instance.release_source = ReleaseSource::start;
  }

  const auto end = live.end ? live.end->time : live.start.time;
  const auto& window = recording_.window_of(live.stream);
  if (!live.end) {
    instance.state = InstanceState::open;
  } else if (!window.contains(live.start.time, end)) {
    instance.state = InstanceState::cut_by_window;
  }

  if (live.end && live.parts && model_.hosts[at(live.host)].has_switches && is_recorded(live)) {
    instance.execution = live.parts->execution;
    instance.preempted = live.parts->preempted;
    instance.blocked = live.parts->blocked;
    instance.wake_delay = live.parts->wake_delay;
    instance.preempted_by = live.preempted_by;
    const auto waiting =
        *instance.end - instance.start - live.parts->execution - live.parts->preempted;
    if (waiting > Duration{} && !recording_.coverage().covers_all(live.host)) {
      instance.blocked.reset();  // who woke it may have done so on a CPU without a record
      instance.wake_delay.reset();
    }
  }
  return instance;
}

std::optional<Timestamp> InstanceMeasurer::source_time(const LiveInstance& live) const {
  if (live.written) return live.written;
  if (live.source_timestamp <= 0 || !live.realtime_offset) return std::nullopt;
  const auto publisher = registry_.publisher_by_gid(live.host, live.writer_gid);
  if (!publisher) return std::nullopt;
  const auto process = model_.publishers[*publisher].process;
  if (model_.processes[at(process)].host != live.host) return std::nullopt;  // another clock
  return Timestamp{detail::wrapping_sub(live.source_timestamp, *live.realtime_offset)};
}

std::optional<Timestamp> InstanceMeasurer::bound_of_release(const LiveInstance& live) const {
  const auto written = source_time(live);
  return written && *written <= live.start.time ? written : std::nullopt;
}

void InstanceMeasurer::expect(const LiveInstance& live) const noexcept {
  const auto& facts = *live.callback_facts;
  prefetch_head(&facts.ended.last);
  prefetch_head(&facts.instances);
  for (const auto* quantity :
       {&facts.response_time, &facts.start_latency, &facts.duration, &facts.inter_arrival}) {
    quantity->expect();
  }
  if (const auto* bounds = bounds_.find(live.callback)) prefetch_to_write(bounds);
  if (const auto* arrivals = arrivals_.find(live.callback)) prefetch_to_write(arrivals);
}

void InstanceMeasurer::measure(const LiveInstance& live) {
  const auto instance = instance_of(live);
  auto& facts = *live.callback_facts;
  const auto& window = recording_.window_of(live.stream);
  if (live.end && window.excludes(live.start.time, live.end->time)) return;
  if (!live.end && window.end && live.start.time > *window.end) return;
  switch (instance.state) {
    case InstanceState::complete:
      count(live, instance);
      chains_.on_complete(*live.node, *live.end);
      break;
    case InstanceState::cut_by_window:
      ++facts.cut_instances;
      break;
    case InstanceState::open:
      ++facts.open_count;
      if (facts.open.size() < kMaxOpenListed) {
        facts.open.push_back(
            OpenInstance{.start = live.start,
                         .seq = live.seq,
                         .release = instance.release,
                         .release_exact = instance.release_source == ReleaseSource::exact,
                         .missed = live.missed,
                         .thread = live.thread.value_or(ThreadIndex{kNoId})});
      }
      break;
  }
  if (observer_ != nullptr) observer_->on_instance(instance);
}

// Nothing else is known of such a timer's releases than that they were not after the starts.
void InstanceMeasurer::forget_releases(CallbackIndex index) {
  chains_.forget_releases(index);
  auto& facts = model_.callbacks[at(index)];
  facts.grid.is_refuted = true;
  facts.exact_instances = 0;
  facts.by_release_source = {};
  facts.by_release_source[static_cast<std::size_t>(ReleaseSource::start)] = facts.instances;
  facts.late = facts.late_by_duration;
  facts.response_time = {};
  facts.response_time_lower = facts.duration;
  facts.response_time_upper = {};
  facts.without_upper_bound = facts.instances;
  facts.start_latency = {};
  facts.inter_arrival = {};
  facts.max_response.reset();
  facts.max_response_upper.reset();
  facts.min_inter_arrival.reset();
  facts.max_inter_arrival.reset();
  facts.release_before_end.reset();
  facts.missed = 0;
  facts.first_missed.reset();
  auto& bounds = bounds_[index];
  bounds = Bounds{.response = {},
                  .response_lower = bounds.response_lower,
                  .response_upper = {},
                  .duration = bounds.duration,
                  .execution = bounds.execution,
                  .duration_without_execution = bounds.duration_without_execution,
                  .min_inter_arrival = {},
                  .max_inter_arrival = {}};
  arrivals_[index] = {};
}

void InstanceMeasurer::count(const LiveInstance& live, const Instance& instance) {
  auto& facts = *live.callback_facts;
  ++facts.instances;
  ++facts.by_release_source[static_cast<std::size_t>(instance.release_source)];
  if (live.source_timestamp != 0 || live.writer_gid != 0) ++facts.messages_told;
  if (facts.response_deadline && least_response_time(instance) > facts.response_deadline) {
    ++facts.late;
    if (*instance.end - instance.start > *facts.response_deadline) ++facts.late_by_duration;
  }
  if (!instance.status) ++facts.without_status;
  if (instance.status == CallbackStatus::exception) {
    ++facts.exceptions;
    if (!facts.first_exception) facts.first_exception = {live.seq, *live.end};
  }
  if (live.thread_facts != nullptr) {
    ++facts.ran_on[live.on_callback].instances;
    ++live.thread_facts->ran[live.on_thread].instances;
  }
  note_response_time(live, instance);
  note_parts(live, instance);
  note_arrival(live, instance);
}

void InstanceMeasurer::note_response_time(const LiveInstance& live, const Instance& instance) {
  auto& facts = *live.callback_facts;
  auto& bounds = bounds_[live.callback];
  const bool is_calculated = instance.release_source == ReleaseSource::timer_grid;
  const auto lower =
      is_calculated ? *instance.end - instance.start : *least_response_time(instance);
  if (bounds.response_lower.rise(lower)) {
    facts.max_response_lower = extreme_of(live, instance, lower);
  }
  if (is_known(instance.release_source)) {
    ++facts.exact_instances;
    const auto response = *response_time(instance);
    facts.response_time.add(response);
    facts.start_latency.add(*start_latency(instance));
    if (bounds.response.rise(response)) {
      facts.max_response = extreme_of(live, instance, response);
    }
    if (bounds.response_upper.rise(response)) {
      facts.max_response_upper = extreme_of(live, instance, response);
    }
  } else {
    facts.response_time_lower.add(lower);
    if (const auto written = bound_of_release(live)) {
      live.node->earliest = written;
      const auto upper = *instance.end - *written;
      facts.response_time_upper.add(upper);
      if (bounds.response_upper.rise(upper)) {
        facts.max_response_upper = extreme_of(live, instance, upper);
      }
    } else {
      ++facts.without_upper_bound;
    }
  }
}

void InstanceMeasurer::note_parts(const LiveInstance& live, const Instance& instance) {
  auto& facts = *live.callback_facts;
  auto& bounds = bounds_[live.callback];
  const auto duration = *instance.end - instance.start;
  facts.duration.add(duration);
  if (bounds.duration.rise(duration)) {
    facts.max_duration = extreme_of(live, instance, duration);
  }
  if (instance.execution) {
    facts.execution_time.add(*instance.execution);
    facts.preempted.add(*instance.preempted);
    note_preemptors(facts, instance.preempted_by);
    if (bounds.execution.rise(*instance.execution)) {
      facts.max_execution = extreme_of(live, instance, *instance.execution);
    }
    if (instance.blocked && instance.wake_delay) {
      facts.blocked.add(*instance.blocked);
      facts.wake_delay.add(*instance.wake_delay);
      const auto sum =
          *instance.execution + *instance.preempted + *instance.blocked + *instance.wake_delay;
      if (sum != duration) ++facts.identity_failures;
    }
  } else {
    if (bounds.duration_without_execution.rise(duration)) {
      facts.max_duration_without_execution = extreme_of(live, instance, duration);
    }
  }
  if (instance.waking && live.wake.first_in) {
    facts.wakeup_latency.add(*live.wake.first_in - *instance.waking);
  }
}

void InstanceMeasurer::note_gap(CallbackFacts& facts, Bounds& bounds, Duration gap,
                                const Arrival& later) {
  facts.inter_arrival.add(gap);
  const auto extreme = [&later, gap] {
    return Extreme<Duration>{.value = gap,
                             .seq = later.seq,
                             .start = later.start,
                             .end = later.end,
                             .release = later.release};
  };
  if (bounds.min_inter_arrival.fall(gap)) facts.min_inter_arrival = extreme();
  if (bounds.max_inter_arrival.rise(gap)) facts.max_inter_arrival = extreme();
}

void InstanceMeasurer::note_pair(CallbackFacts& facts, Bounds& bounds, const Arrival& earlier,
                                 const Arrival& later) {
  note_gap(facts, bounds, later.release - earlier.release, later);
  const bool is_after_end = later.release > earlier.end.time;
  if (is_after_end || facts.release_before_end || facts.has_grid_releases()) return;
  facts.release_before_end = CallbackFacts::ReleaseBeforeEnd{.seq = earlier.seq,
                                                             .start = earlier.start,
                                                             .end = earlier.end,
                                                             .next_release = later.release,
                                                             .next_start = later.start};
}

void InstanceMeasurer::note_arrival(const LiveInstance& live, const Instance& instance) {
  if (!is_known(instance.release_source)) return;
  auto& facts = *live.callback_facts;
  auto& bounds = bounds_[live.callback];
  auto& arrivals = arrivals_[live.callback];
  Arrival arrived{
      .seq = live.seq, .start = live.start, .end = *live.end, .release = *instance.release};
  const auto pair = [&](Arrival& earlier, Arrival& later) {
    note_pair(facts, bounds, earlier, later);
    earlier.has_next = later.has_previous = true;
  };
  const auto pair_with = [&](Arrival& other) {
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
