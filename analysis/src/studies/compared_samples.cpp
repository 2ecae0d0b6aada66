#include <cie/analysis/comparison.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/response_time.hpp>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// Of callbacks of one id in several processes: what is worst of those that ran.
std::optional<Isolation> worst_of(std::optional<Isolation> a, std::optional<Isolation> b) {
  if (a == Isolation::never_ran) return b;
  if (b == Isolation::never_ran) return a;
  if (a == Isolation::not_isolated || b == Isolation::not_isolated) return Isolation::not_isolated;
  return a && b ? a : std::nullopt;
}

std::optional<bool> any_of(std::optional<bool> a, std::optional<bool> b) {
  if (a == true || b == true) return true;
  return a && b ? a : std::nullopt;
}

// A run that an edge of the recording cut is none.
bool never_ends(const CallbackReport& callback) {
  return callback.longest_open && callback.longest_open->response_least;
}

// Who is given threads of its own. ROS 2's events name no executor: there it is whose process has no
// callback that shares its thread.
class IsolationClaims {
 public:
  IsolationClaims(const Report& report, const ReportRows& rows) : rows_(rows) {
    for (const auto& callback : report.callbacks)
      if (callback.isolation == Isolation::not_isolated) sharing_.insert(callback.process);
  }
  bool of(const CallbackReport& callback) const {
    const auto& process = rows_.process_of(callback);
    if (!process.executor) return !sharing_.contains(callback.process);
    return is_isolated_executor_alone(process) ||
           std::ranges::any_of(callback.threads, [this](const CallbackThread& ran_on) {
             const auto* thread = rows_.find(ran_on.thread);
             return thread != nullptr && thread->role == ThreadRole::callback;
           });
  }

 private:
  const ReportRows& rows_;
  std::set<ProcessIndex> sharing_;
};

// A sum of which one part is unknown is unknown.
void add(std::optional<std::uint64_t>& into, const std::optional<std::uint64_t>& other) {
  into = into && other ? std::optional(*into + *other) : std::nullopt;
}

void merge(CallbackSample& into, const CallbackSample& other) {
  into.processes += other.processes;
  if (!other.processes_at_once) into.processes_at_once.reset();
  into.are_lives_told = into.are_lives_told && other.are_lives_told;
  into.instances += other.instances;
  into.incomplete += other.incomplete;
  into.runs_not_seen += other.runs_not_seen;
  into.never_ends = any_of(into.never_ends, other.never_ends);
  into.response_time = merged(into.response_time, other.response_time);
  into.start_latency = merged(into.start_latency, other.start_latency);
  into.duration = merged(into.duration, other.duration);
  add(into.exceptions, other.exceptions);
  into.isolation = worst_of(into.isolation, other.isolation);
  into.is_isolation_claimed = into.is_isolation_claimed && other.is_isolation_claimed;
  add(into.missed_releases, other.missed_releases);
  add(into.missing_instances, other.missing_instances);
  add(into.lost_samples, other.lost_samples);
  add(into.overwritten_samples, other.overwritten_samples);
  into.timer_releases.are_recorded |= other.timer_releases.are_recorded;
  into.timer_releases.are_of_grid |= other.timer_releases.are_of_grid;
  if (!into.lateness || !other.lateness) {
    if (other.lateness) into.lateness = other.lateness;
    return;
  }
  into.lateness->deadline = std::min(into.lateness->deadline, other.lateness->deadline);
  into.lateness->late += other.lateness->late;
  into.lateness->instances += other.lateness->instances;
  into.lateness->is_late_bound = into.lateness->is_late_bound || other.lateness->is_late_bound;
  if (other.lateness->max > into.lateness->max) {
    into.lateness->max = other.lateness->max;
    into.lateness->is_max_bound = other.lateness->is_max_bound;
  }
}

using WindowsByHost = std::map<HostIndex, std::vector<TimeWindow>>;  // by the host's clock

std::uint64_t most_at_once(const WindowsByHost& windows_by_host) {
  std::uint64_t all = 0;
  for (const auto& [host, windows] : windows_by_host) {
    std::vector<std::pair<Timestamp, bool>>
        edges;  // and whether it is an end: windows include both
    for (const auto& window : windows) {
      edges.emplace_back(window.from, false);
      edges.emplace_back(window.to, true);
    }
    std::ranges::sort(edges);
    std::int64_t open = 0;
    std::int64_t most = 0;
    for (const auto& [time, is_end] : edges) {
      open += is_end ? -1 : 1;
      most = std::max(most, open);
    }
    all += static_cast<std::uint64_t>(most);
  }
  return all;
}

OrderStatistics statistics_of(const auto& bounded) {
  return OrderStatistics::of(bounded.at_least, bounded.at_most);
}

}  // namespace

CallbackSample CallbackSample::of(const CallbackReport& callback) {
  const auto since = [](std::optional<std::uint64_t> total,
                        const std::optional<std::uint64_t>& before) {
    if (total) *total -= std::min(*total, before.value_or(0));
    return total;
  };
  CallbackSample sample;
  sample.logical_id = callback.logical_id;
  sample.instances = callback.instances;
  sample.incomplete = callback.incomplete;
  sample.runs_not_seen = callback.runs_not_seen;
  sample.exceptions = callback.exceptions;
  sample.missed_releases = callback.missed_releases;
  sample.isolation = callback.isolation;
  sample.lateness = Lateness::of(callback);
  sample.lost_samples = since(callback.lost_samples, callback.lost_before);
  sample.overwritten_samples = since(callback.overwritten_samples, callback.overwritten_before);
  sample.timer_releases = TimerReleases::of(callback);
  return sample;
}

void SamplesById::add(CallbackSample sample) {
  const auto [place, is_new] = places_.try_emplace(sample.logical_id, samples_.size());
  if (is_new) {
    samples_.push_back(std::move(sample));
  } else {
    merge(samples_[place->second], sample);
  }
}

// When callbacks of one id lived, for certain and at most.
struct SampleCollector::Lives {
  WindowsByHost at_least;
  WindowsByHost at_most;

  std::optional<std::uint64_t> most_at_once() const {
    const auto least = analysis::most_at_once(at_least);
    return least == analysis::most_at_once(at_most) ? std::optional(least) : std::nullopt;
  }
};

std::map<std::string_view, SampleCollector::Lives> SampleCollector::lives_by_id(
    const Report& report, const ReportRows& rows) const {
  const TimeWindow unknown;
  std::map<std::string_view, Lives> lives_by_id;
  for (const auto& callback : report.callbacks) {
    auto& lives = lives_by_id[callback.logical_id];
    const auto& process = rows.process_of(callback);
    const auto at_most = life_of(callback, process);
    lives.at_most[process.host_index].push_back(at_most);
    const auto number = at(callback.index);
    const bool has_run = number < measured_.size() && !measured_[number].logical_id.empty();
    auto at_least = TimeWindow{.from = callback.lived.from, .to = at_most.to};
    if (has_run && at_least.from == unknown.from) at_least.from = measured_[number].first_start;
    if (at_least.from == unknown.from) continue;
    if (at_least.to == unknown.to)
      at_least.to = has_run ? measured_[number].last_end : at_least.from;
    lives.at_least[process.host_index].push_back(at_least);
  }
  return lives_by_id;
}

void SampleCollector::on_instance(const Instance& instance) {
  if (instance.state != InstanceState::complete || !instance.end || instance.logical_id.empty()) {
    return;
  }
  const auto number = at(instance.callback);
  if (number >= measured_.size()) measured_.resize(number + 1);
  auto& measured = measured_[number];
  if (measured.logical_id.empty()) {
    measured.logical_id = instance.logical_id;
    measured.first_start = instance.start;
    measured.last_end = *instance.end;
  }
  measured.first_start = std::min(measured.first_start, instance.start);
  measured.last_end = std::max(measured.last_end, *instance.end);
  const auto duration = *instance.end - instance.start;
  measured.duration.add(duration);
  if (instance.missed.value_or(0) > 0) ++measured.missing_instances;
  const bool is_exact = is_known(instance.release_source) && instance.release;
  const auto least =
      is_exact ? *response_time(instance) : least_response_time(instance).value_or(duration);
  measured.response_time.at_least.add(least);
  measured.start_latency.at_least.add(least - duration);
  if (!is_exact && instance.release_source != ReleaseSource::source_timestamp) return;
  // Clocks that disagree put a source timestamp after the start.
  const auto most = std::max(response_time(instance).value_or(least), least);
  measured.response_time.at_most.add(most);
  measured.start_latency.at_most.add(most - duration);
}

void SampleCollector::Measured::merge_quantities(const Measured& other) {
  response_time.at_least.merge(other.response_time.at_least);
  response_time.at_most.merge(other.response_time.at_most);
  start_latency.at_least.merge(other.start_latency.at_least);
  start_latency.at_most.merge(other.start_latency.at_most);
  duration.merge(other.duration);
  missing_instances += other.missing_instances;
}

SampleCollector::Measured SampleCollector::Measured::without_releases() const {
  Measured rest;
  rest.response_time.at_least = duration;
  rest.duration = duration;
  rest.missing_instances = missing_instances;
  for (std::uint64_t i = 0; i < duration.count(); ++i)
    rest.start_latency.at_least.add(Duration{});
  return rest;
}

std::vector<CallbackSample> SampleCollector::samples(const Report& report) const {
  // A timer's calculated releases may have been taken back.
  std::vector<bool> has_no_releases(measured_.size());
  for (const auto& callback : report.callbacks) {
    if (at(callback.index) < has_no_releases.size()) {
      has_no_releases[at(callback.index)] =
          callback.kind == CallbackKind::timer && !callback.response_time;
    }
  }
  std::map<std::string_view, Measured> by_id;
  const ReportRows rows(report);
  const IsolationClaims claims(report, rows);
  const auto lives = lives_by_id(report, rows);
  for (std::size_t i = 0; i < measured_.size(); ++i) {
    const auto& measured = measured_[i];
    auto& sum = by_id[measured.logical_id];
    sum.merge_quantities(has_no_releases[i] ? measured.without_releases() : measured);
  }
  SamplesById samples;
  for (const auto& callback : report.callbacks) {
    auto sample = CallbackSample::of(callback);
    sample.processes_at_once = lives.at(callback.logical_id).most_at_once();
    sample.never_ends = never_ends(callback);
    sample.is_isolation_claimed = claims.of(callback);
    if (callback.missed_releases) sample.missing_instances = 0;
    // The first one of an id has what all of them measured.
    if (const auto found = by_id.find(callback.logical_id); found != by_id.end()) {
      const auto& measured = found->second;
      sample.response_time = statistics_of(measured.response_time);
      sample.start_latency = statistics_of(measured.start_latency);
      sample.duration = OrderStatistics::of(measured.duration);
      if (sample.missing_instances) sample.missing_instances = measured.missing_instances;
      by_id.erase(found);
    }
    samples.add(std::move(sample));
  }
  return std::move(samples).take();
}

}  // namespace cie::analysis
