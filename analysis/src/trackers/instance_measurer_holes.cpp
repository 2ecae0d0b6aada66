// What holes in the kernel's record make of instances: whether one was recorded whole, and those that were
// measured before a hole was told of: a CPU that stays idle for longer than they wait tells of it by its
// next switch.
#include "instance_measurer.hpp"

#include <tuple>

namespace cie::analysis {
namespace {

// What it executed may be less. It ran on no other CPU than where it began if it was there all the time.
bool may_be_wrong(const Extreme<Duration>& executed, const ThreadTimeline::Hole& hole) {
  const auto& [start, end] = std::tie(executed.start, executed.end);
  if (!end || hole.end < start.time || end->time < hole.begin) return false;
  const bool has_left = executed.value < end->time - start.time;
  return has_left || hole.cpu < 0 || !start.cpu || *start.cpu == hole.cpu;
}

}  // namespace

void InstanceMeasurer::hole_was_told(HostIndex host, const ThreadTimeline::Hole& hole) {
  const auto take_back = [&hole](Rare<Extreme<Duration>>& most) {
    if (most && may_be_wrong(*most, hole)) most.reset();
  };
  for (std::size_t i = 0; i < model_.callbacks.size(); ++i) {
    auto& facts = model_.callbacks[i];
    if (model_.processes[at(facts.process)].host != host) continue;
    if (facts.own) take_back(facts.own->max_execution);
    if (facts.outside) take_back(facts.outside->max_execution);
    if (!facts.max_execution || !may_be_wrong(*facts.max_execution, hole)) continue;
    auto unmeasured = *facts.max_execution;
    unmeasured.value = unmeasured.end->time - unmeasured.start.time;
    auto& bounds = bounds_[CallbackIndex{static_cast<std::uint32_t>(i)}];
    if (bounds.duration_without_execution.rise(unmeasured.value)) {
      facts.max_duration_without_execution = unmeasured;
      note_unmeasured(facts, unmeasured.value);
    }
    facts.max_execution.reset();
    bounds.execution = {};
  }
}

bool InstanceMeasurer::is_recorded(const PendingInstance& pending) const {
  const auto begin = pending.start.time;
  const auto end = pending.end ? pending.end->time : *pending.measured_to;
  const auto& coverage = recording_.coverage();
  if (!pending.parts->has_left && pending.start.cpu) {  // then no other CPU matters
    const std::optional<std::int32_t> cpu = pending.start.cpu;
    return recording_.kernel_window(pending.host, begin, cpu).contains(begin, end) &&
           coverage.covers(pending.host, *pending.start.cpu) &&
           !timeline_.overlaps_hole(pending.host, begin, end, pending.start.cpu);
  }
  return recording_.kernel_window(pending.host, begin).contains(begin, end) &&
         (pending.is_confined || coverage.covers_all(pending.host)) &&
         !timeline_.overlaps_hole(pending.host, begin, end);
}

}  // namespace cie::analysis
