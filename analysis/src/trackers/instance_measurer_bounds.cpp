// Of instances whose release is not known: what its message tells.
#include "instance_measurer.hpp"

#include <vector>

namespace cie::analysis {

OptionalTime InstanceMeasurer::find_source_time(const PendingInstance& pending) const {
  if (!pending.realtime_offset) return {};
  const auto publisher = registry_.publisher_by_gid(pending.host, pending.writer_gid);
  if (!publisher) return {};
  const auto process = model_.publishers[*publisher].process;
  if (model_.processes[at(process)].host != pending.host) return {};  // another clock
  return Timestamp{detail::wrapping_sub(pending.source_timestamp, *pending.realtime_offset)};
}

void InstanceMeasurer::note_upper(CallbackFacts& facts, Bounds& bounds,
                                  const Extreme<Duration>& upper) {
  facts.response_time_upper.add(upper.value);
  if (bounds.response_upper.rise(upper.value)) facts.max_response_upper = upper;
}

void InstanceMeasurer::note_bounded(const PendingInstance& pending, const Measured& measured,
                                    Timestamp written, Bounds& bounds) {
  auto& facts = *pending.callback_facts;
  if (pending.node) pending.node->earliest = written;
  const auto upper = extreme_of(pending, measured, pending.end->time - written);
  auto& bounded = bounded_[pending.host];
  // Of ROS 2 the messages show it themselves.
  if (!facts.is_accounted || clocks_.were_read_since(pending.host, pending.start.time) ||
      bounded.size() >= kMostBounded) {
    note_upper(facts, bounds, upper);
    return;
  }
  bounded.push_back(
      {.callback = pending.callback, .source_timestamp = pending.source_timestamp, .upper = upper});
}

void InstanceMeasurer::clocks_were_read(HostIndex host) {
  std::erase_if(bounded_[host], [&](const Bounded& bounded) {
    const auto start = bounded.upper.start.time;
    if (!clocks_.were_read_since(host, start)) return false;
    if (clocks_.may_be_set_between(host, bounded.source_timestamp, start)) {
      auto& facts = model_.callbacks[at(bounded.callback)];
      ++facts.without_upper_bound;
      ++facts.with_doubtful_bound;
    } else {
      take_bound(bounded);
    }
    return true;
  });
}

void InstanceMeasurer::take_bound(const Bounded& bounded) {
  note_upper(model_.callbacks[at(bounded.callback)], bounds_[bounded.callback], bounded.upper);
}

void InstanceMeasurer::finish() {
  for (auto& of_host : bounded_) {
    for (const auto& bounded : of_host)
      take_bound(bounded);
    of_host.clear();
  }
}

}  // namespace cie::analysis
