#include "simulator/comparison.hpp"

#include <algorithm>

namespace cie::sim {
namespace {

std::optional<Ns> number(const std::optional<analysis::Timestamp>& time) {
  return time ? std::optional(time->ns) : std::nullopt;
}
std::optional<Ns> number(const std::optional<analysis::Duration>& time) {
  return time ? std::optional(time->ns) : std::nullopt;
}

}  // namespace

std::string text(const std::map<std::int64_t, Ns>& by_tid) {
  std::string all;
  for (const auto& [tid, time] : by_tid)
    all += std::to_string(tid) + ": " + std::to_string(time) + ' ';
  return all;
}
std::optional<Comparison::Shown> Comparison::shown(const InstanceTruth& instance) const {
  if (!is_recorded(instance.start, instance.cpu_start)) return std::nullopt;
  Shown shown;
  if (!is_end_recorded(instance)) {
    if (instance.start > window_end()) return std::nullopt;
    shown.state = InstanceState::open;
  } else if (*instance.end < window_begin() || instance.start > window_end()) {
    return std::nullopt;
  } else if (instance.start < window_begin() || *instance.end > window_end()) {
    shown.state = InstanceState::cut_by_window;
  }
  shown.has_parts = recording_.has_kernel && shown.state != InstanceState::open &&
                    instance.start >= recording_.kernel_begin && *instance.end <= kernel_end();
  if (instance.wakeup && is_recorded(*instance.wakeup, instance.cpu_wakeup))
    shown.wakeup = instance.wakeup;
  const auto& wake = instance.kernel_wakeup;
  if (recording_.has_kernel) {
    shown.waking = recording_.has_wakings ? wake.waking : wake.wakeup;
    shown.first_in = recording_.has_wakings ? wake.first_in : wake.first_in_runnable;
    if (shown.waking && *shown.waking < recording_.kernel_begin) shown.waking.reset();
  }
  const auto& callback = system_.callbacks[static_cast<std::size_t>(instance.callback)];
  const auto& thread = truth_.threads[instance.thread];
  const bool is_isolated = thread.name.starts_with("cb");
  const auto* message =
      instance.message && callback.tells_source ? &truth_.messages[*instance.message] : nullptr;
  shown.release = instance.release;
  if (!callback.tells_release) {
    auto woken = shown.waking ? shown.waking : shown.wakeup;
    // Another message woke the thread, and was overwritten (definitions.md: "Missing release").
    constexpr std::int64_t kReadingsDiffer = 100'000;
    if (woken && message != nullptr && message->stamp - kRealtimeOffset > *woken + kReadingsDiffer)
      woken.reset();
    if (is_isolated && woken) {
      shown.source = ReleaseSource::wakeup;
      shown.release = *woken;
    } else if (message != nullptr) {
      shown.source = ReleaseSource::source_timestamp;
      shown.release = message->stamp - kRealtimeOffset;
    } else {
      shown.source = ReleaseSource::start;
      shown.release = instance.start;
    }
    if (message != nullptr && instance.end) {
      shown.upper = *instance.end - (message->stamp - kRealtimeOffset);
    }
  }
  return shown;
}

bool Comparison::compare_instance(const InstanceTruth& instance) {
  const auto shown = this->shown(instance);
  const auto& thread = truth_.threads[instance.thread];
  const auto& callback = system_.callbacks[static_cast<std::size_t>(instance.callback)];
  const auto row = rows_.find({thread.pid, callback.id, instance.seq});
  const auto name = callback.id + " seq " + std::to_string(instance.seq);
  equal(name + " is listed", row != rows_.end(), shown.has_value());
  if (!shown) return false;
  if (row != rows_.end()) compare_row(instance, *shown, observed_.rows[row->second]);
  add(instance, *shown);
  if (!is_end_recorded(instance)) unended_.insert(instance.thread);
  return true;
}

void Comparison::compare_row(const InstanceTruth& instance, const Shown& shown,
                             const Observed::Row& row) {
  const auto& said = row.instance;
  const auto name = row.logical_id + " seq " + std::to_string(said.seq) + ' ';
  equal(name + "state", static_cast<int>(said.state), static_cast<int>(shown.state));
  equal(name + "tid", said.tid, truth_.threads[instance.thread].tid);
  equal(name + "start", said.start.ns, instance.start);
  const bool has_end = shown.state != InstanceState::open;
  equal(name + "end", number(said.end), has_end ? instance.end : std::nullopt);
  equal(name + "missed", said.missed.value_or(-1), instance.missed);
  equal(name + "cpu at start", said.cpu_start.value_or(-1), instance.cpu_start);
  if (has_end) equal(name + "cpu at end", said.cpu_end.value_or(-1), instance.cpu_end);
  // What woke a thread is known if the end of its instance before is.
  const bool is_wake_known =
      is_whole() || (instance.previous && is_end_recorded(truth_.instances[*instance.previous]) &&
                     *truth_.instances[*instance.previous].end >= recording_.kernel_begin &&
                     instance.start <= kernel_end());
  if (is_wake_known) {
    equal(name + "wakeup", number(said.wakeup), shown.wakeup);
    equal(name + "waking", number(said.waking), shown.waking);
    equal(name + "release source", label(said.release_source), label(shown.source));
    equal(name + "release", number(said.release), std::optional(shown.release));
  }
  std::optional<Ns> execution, preempted, blocked, delay;
  if (shown.has_parts) {
    const auto& parts = instance.parts;
    const auto unseen = recording_.has_wakings ? 0 : parts.waking;
    execution = parts.execution;
    preempted = parts.preempted;
    blocked = parts.blocked + unseen;
    delay = parts.wake_delay - unseen;
    std::map<std::int64_t, Ns> instead;
    for (const auto& preemptor : row.preempted_by)
      instead[preemptor.tid] += preemptor.time.ns;
    // After an instance whose end was not recorded, later ones of its thread may lie inside it.
    if (!unended_.contains(instance.thread)) {
      equal(name + "preempted by", text(instead), text(parts.instead));
    }
  }
  equal(name + "execution", number(said.execution), execution);
  equal(name + "preempted", number(said.preempted), preempted);
  equal(name + "blocked", number(said.blocked), blocked);
  equal(name + "wake delay", number(said.wake_delay), delay);
}

void Comparison::add(const InstanceTruth& instance, const Shown& shown) {
  auto& figures = figures_[static_cast<std::size_t>(instance.callback)];
  figures.missed += instance.missed;
  if (shown.state == InstanceState::open) ++figures.open;
  if (shown.state == InstanceState::cut_by_window) ++figures.cut;
  if (shown.state != InstanceState::complete) return;
  ++figures.complete;
  ++figures.by_thread[truth_.threads[instance.thread].tid];
  ++figures.sources[shown.source];
  const auto end = *instance.end;
  figures.duration.push_back(end - instance.start);
  if (shown.source == ReleaseSource::exact) {
    figures.response.push_back(end - instance.release);
    figures.latency.push_back(instance.start - instance.release);
    if (figures.last && figures.last->first + 1 == instance.seq) {
      figures.arrival.push_back(instance.release - figures.last->second);
    }
    figures.last = {instance.seq, instance.release};
  } else {
    figures.lower.push_back(
        end - (shown.source == ReleaseSource::wakeup ? shown.release : instance.start));
    if (shown.upper) figures.upper.push_back(*shown.upper);
  }
  if (shown.has_parts) {
    const auto unseen = recording_.has_wakings ? 0 : instance.parts.waking;
    figures.execution.push_back(instance.parts.execution);
    figures.preempted.push_back(instance.parts.preempted);
    figures.blocked.push_back(instance.parts.blocked + unseen);
    figures.delay.push_back(instance.parts.wake_delay - unseen);
    for (const auto& [tid, time] : instance.parts.instead)
      figures.instead[tid] += time;
  }
  if (shown.waking && shown.first_in) figures.wakeup.push_back(*shown.first_in - *shown.waking);
}

void Observed::on_instance(const analysis::Instance& instance) {
  rows.push_back({.instance = instance,
                  .logical_id = std::string(instance.logical_id),
                  .preempted_by = {instance.preempted_by.begin(), instance.preempted_by.end()}});
}

void analyze(const test::TextTrace& trace, const analysis::AnalysisOptions& options,
             Observed& observed) {
  observed.result = test::analyze(trace, options, &observed);
}

std::vector<std::string> differences(const System& system, const Simulation& simulation,
                                     const Recording& recording, const Observed& observed) {
  return Comparison(system, simulation, recording, observed).run();
}

}  // namespace cie::sim
