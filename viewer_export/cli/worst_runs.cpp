#include "worst_runs.hpp"

#include <cie/analysis/deadline.hpp>

#include <utility>

namespace cie::cli {

using analysis::Instance;
using viewer_export::WorstRun;

void WorstRuns::on_instance(const Instance& instance) {
  if (instance.state != analysis::InstanceState::complete) return;
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
                   .blocked = instance.blocked,
                   .preempted = instance.preempted};
  if (is_known(instance.release_source)) worst->start_latency = analysis::start_latency(instance);
  if (!instance.preempted_by.empty()) worst->preempted_by = instance.preempted_by.front().name;
}

std::vector<WorstRun> WorstRuns::take() && {
  std::vector<WorstRun> all;
  for (auto& run : runs_) {
    if (run) all.push_back(*std::move(run));
  }
  return all;
}

}  // namespace cie::cli
