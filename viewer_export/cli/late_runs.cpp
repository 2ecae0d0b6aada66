#include "late_runs.hpp"

#include <cie/analysis/deadline.hpp>

#include <string>
#include <utility>

namespace cie::cli {

using analysis::Instance;
using viewer_export::Lateness;

std::optional<Lateness> LateRuns::look_up(const Instance& instance) const {
  const auto* entry = spec_ != nullptr ? spec_->find_callback(instance.logical_id) : nullptr;
  const auto deadline = analysis::response_deadline(entry, instance.declared_deadline_ns);
  if (!deadline) return std::nullopt;
  Lateness lateness;
  lateness.callback = instance.callback;
  lateness.deadline = *deadline;
  if (entry != nullptr && entry->response_deadline_ns)
    lateness.place = spec_->name() + ':' + std::to_string(entry->line);
  return lateness;
}

void LateRuns::on_instance(const Instance& instance) {
  if (instance.state != analysis::InstanceState::complete) return;
  const auto response = analysis::least_response_time(instance);
  if (!response || instance.logical_id.empty()) return;
  const auto place = analysis::at(instance.callback);
  if (place >= callbacks_.size()) callbacks_.resize(place + 1);
  auto& callback = callbacks_[place];
  if (!callback.is_known) callback = {.is_known = true, .lateness = look_up(instance)};
  if (!callback.lateness) return;
  auto& lateness = *callback.lateness;
  ++lateness.instances;
  if (*response > lateness.deadline) ++lateness.late;
  if (lateness.instances > 1 && *response <= lateness.worst.response_time) return;
  lateness.worst = {.seq = instance.seq, .start = instance.start, .response_time = *response};
  if (instance.release_source == analysis::ReleaseSource::exact)
    lateness.worst.start_latency = analysis::start_latency(instance);
  lateness.worst.preempted = instance.preempted;
  if (!instance.preempted_by.empty())
    lateness.worst.preempted_by = instance.preempted_by.front().name;
}

std::vector<Lateness> LateRuns::take() && {
  std::vector<Lateness> all;
  for (auto& callback : callbacks_) {
    if (callback.lateness) all.push_back(*std::move(callback.lateness));
  }
  return all;
}

}  // namespace cie::cli
