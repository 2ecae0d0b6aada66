// What streams cover one by one, of which a channel's window is what all of them do.
#include "recording_tracker.hpp"

#include <algorithm>

namespace cie::analysis {

void RecordingTracker::add_streams_of(const Channel& channel, Duration shift) {
  auto& all = model_.covered_by_any;
  for (const auto index : channel.streams) {
    auto& facts = model_.streams[index];
    const auto& state = *states_.find(StreamIndex{index});
    if (!narrows(facts, state)) continue;
    if (!state.is_idle) facts.covers_from = facts.begin;
    if (state.ended) facts.covers_to = facts.end;
    if (!facts.covers_from || !facts.end) continue;
    const TimeWindow covers{.from = *facts.begin + shift, .to = *facts.end + shift};
    if (!all) all = covers;
    all->from = std::min(all->from, covers.from);
    all->to = std::max(all->to, covers.to);
  }
}

}  // namespace cie::analysis
