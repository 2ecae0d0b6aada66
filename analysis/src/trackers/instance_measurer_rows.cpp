// What observers are told: a row per instance, at once or when a timer's releases are proven.
#include <cie/analysis/namespaced_pid.hpp>

#include "instance_measurer.hpp"
#include "model/callback_questions.hpp"

#include <optional>
#include <vector>

namespace cie::analysis {

Instance InstanceMeasurer::instance_of(const PendingInstance& pending,
                                       const Measured& measured) const {
  const auto& facts = *pending.callback_facts;
  Instance instance;
  if (has_logical_id(facts)) instance.logical_id = facts.logical_id;
  instance.callback = pending.callback;
  instance.process = facts.process;
  instance.pid = plain_pid(pending.start.pid.value_or(-1));
  instance.tid = pending.start.tid.value_or(-1);
  instance.seq = pending.seq;
  instance.state = measured.state;
  instance.status = pending.status;
  instance.release = measured.release;
  instance.release_source = measured.release_source;
  instance.wakeup = pending.wakeup;
  instance.waking = measured.waking;
  instance.start = pending.start.time;
  if (pending.end) instance.end = pending.end->time;
  instance.cpu_start = pending.start.cpu;
  if (pending.end) instance.cpu_end = pending.end->cpu;
  if (measured.parts) {
    instance.execution = measured.parts->execution;
    instance.preempted = measured.parts->preempted;
    if (measured.has_wake_parts) {
      instance.blocked = measured.parts->blocked;
      instance.wake_delay = measured.parts->wake_delay;
    }
    instance.preempted_by = pending.preempted_by;
  }
  // One that nobody described may be a timer, unless it took a message.
  const bool may_be_timer = facts.kind.value_or(CallbackKind::timer) == CallbackKind::timer &&
                            (facts.kind || pending.source_timestamp == 0);
  if (may_be_timer) {
    const bool is_told =
        pending.is_missed_known && (facts.is_accounted || is_known(instance.release_source));
    instance.missed = is_told ? std::optional(pending.missed) : std::nullopt;
  }
  instance.response_deadline = facts.response_deadline;
  instance.source_timestamp_realtime_ns = pending.source_timestamp;
  instance.writer_gid = pending.writer_gid;
  instance.host = pending.host;
  return instance;
}

void InstanceMeasurer::hold_back(const PendingInstance& pending, const Measured& measured) {
  auto& unproven = unproven_[pending.callback];
  if (unproven.rows.size() >= Unproven::kMost || held_back_ >= Unproven::kMostRows)
    tell_bounds(pending.callback, unproven);
  auto instance = instance_of(pending, measured);
  instance.release = measured.unproven;
  instance.release_source = ReleaseSource::timer_grid;
  instance.missed = pending.is_missed_known ? std::optional(pending.missed) : std::nullopt;
  unproven.rows.push_back({.instance = instance, .preempted_by = pending.preempted_by});
  ++held_back_;
}

void InstanceMeasurer::tell_rows(CallbackIndex index, Unproven& unproven) {
  const auto& facts = model_.callbacks[at(index)];
  for (auto& [instance, preempted_by] : unproven.rows) {
    if (has_logical_id(facts)) instance.logical_id = facts.logical_id;  // it may have moved
    instance.preempted_by = preempted_by;
    observer_->on_instance(instance);
  }
  held_back_ -= unproven.rows.size();
  std::vector<Row>().swap(unproven.rows);
}

void InstanceMeasurer::tell_bounds(CallbackIndex index, Unproven& unproven) {
  for (auto& [instance, preempted_by] : unproven.rows) {
    instance.release = instance.start;
    instance.release_source = ReleaseSource::start;
    instance.missed.reset();
  }
  tell_rows(index, unproven);
}

}  // namespace cie::analysis
