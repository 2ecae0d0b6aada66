#include "instance_measurer.hpp"

namespace cie::analysis {

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
  facts.response_time_lower = {};
  facts.is_lower_duration = true;
  facts.response_time_upper = {};
  facts.without_upper_bound = facts.instances;
  facts.start_latency = {};
  facts.inter_arrival = {};
  facts.max_response.reset();
  facts.max_response_parts = {};
  facts.max_response_upper.reset();
  facts.min_inter_arrival.reset();
  facts.max_inter_arrival.reset();
  facts.release_before_end.reset();
  facts.missed = 0;
  facts.first_missed.reset();
  if (facts.own) {
    facts.own->missed = 0;
    facts.own->first_missed.reset();
    facts.own->max_response.reset();
  }
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
  for (auto* extreme : longest_of(facts)) {
    if (extreme != nullptr) extreme->release = {};
  }
  auto* unproven = unproven_.find(index);
  if (unproven == nullptr) return;
  unproven->instances.clear();
  tell_bounds(index, *unproven);
}

void InstanceMeasurer::leave_bounds(CallbackIndex index) {
  auto* unproven = unproven_.find(index);
  if (unproven == nullptr) return;
  tell_bounds(index, *unproven);
  auto& instances = unproven->instances;
  auto& has_left_bounds = unproven->has_left_bounds;
  auto& facts = model_.callbacks[at(index)];
  for (const auto& instance : instances)
    facts.response_time_lower.add(instance.end.time - instance.start.time);
  has_left_bounds = has_left_bounds || !instances.empty();
  instances.clear();
  if (has_left_bounds) chains_.forget_releases(index);
}

}  // namespace cie::analysis
