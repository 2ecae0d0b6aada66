#include "worst_runs.hpp"

#include <cie/analysis/response_time.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace cie::cli {

using analysis::Instance;
using viewer_export::WorstRun;

std::optional<WorstRun::Behind> WorstRuns::behind(const Instance& instance) const {
  if (instance.tid < 0) return std::nullopt;  // its thread is not known
  const auto latency = analysis::start_latency(instance);
  const auto found = pasts_.find({instance.process, instance.tid});
  if (!latency || found == pasts_.end()) return std::nullopt;
  std::map<analysis::CallbackIndex, std::int64_t> times;
  for (const auto& past : found->second.runs) {
    const auto begin = std::max(past.start, *instance.release);
    const auto end = std::min(past.end, instance.start);
    if (begin < end) times[past.callback] += (end - begin).ns;
  }
  const auto most =
      std::ranges::max_element(times, {}, [](const auto& item) { return item.second; });
  if (most == times.end() || 2 * most->second < latency->ns) return std::nullopt;
  const auto& forgotten = found->second.forgotten_until;
  return WorstRun::Behind{.callback = most->first,
                          .time = {most->second},
                          .is_at_least = forgotten && *forgotten > *instance.release};
}

void WorstRuns::on_instance(const Instance& instance) {
  if (instance.state != analysis::InstanceState::complete) return;
  note(instance);
  constexpr std::size_t kMost = 64;
  auto& [runs, forgotten_until] = pasts_[{instance.process, instance.tid}];
  runs.push_back({.callback = instance.callback, .start = instance.start, .end = *instance.end});
  if (runs.size() <= kMost) return;
  forgotten_until = runs.front().end;
  runs.pop_front();
}

void WorstRuns::note(const Instance& instance) {
  const auto response = analysis::response_time_or_bound(instance);
  if (!response) return;
  const auto place = analysis::at(instance.callback);
  if (place >= runs_.size()) runs_.resize(place + 1);
  auto& worst = runs_[place];
  if (worst && *response <= worst->response_time) return;
  worst = WorstRun{.callback = instance.callback,
                   .seq = instance.seq,
                   .start = instance.start,
                   .response_time = *response,
                   .execution = instance.execution,
                   .blocked = instance.blocked,
                   .wake_delay = instance.wake_delay,
                   .preempted = instance.preempted};
  if (is_known(instance.release_source)) {
    worst->start_latency = analysis::start_latency(instance);
    worst->behind = behind(instance);
  }
  for (const auto& by : instance.preempted_by) {
    if (by.is_idle()) {
      worst->idle = by.time;
    } else if (by.time > worst->preempted_by_time) {
      worst->preempted_by = by.name;
      worst->preempted_by_time = by.time;
    }
  }
}

std::vector<WorstRun> WorstRuns::take() && {
  std::vector<WorstRun> all;
  for (auto& run : runs_) {
    if (run) all.push_back(*std::move(run));
  }
  return all;
}

}  // namespace cie::cli
