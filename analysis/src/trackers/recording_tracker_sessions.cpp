// What lies between the windows of two sessions that recorded one process.
#include "recording_tracker.hpp"

#include <algorithm>
#include <string>

namespace cie::analysis {

template <typename IsSo>
bool RecordingTracker::is_any_other(StreamIndex stream, const IsSo& is_so) const {
  const auto& own = model_.streams[at(stream)];
  return std::ranges::any_of(channels_, [&](const auto& entry) {
    const auto& channel = entry.second;
    const auto& first = model_.streams[channel.streams.front()];
    return channel.domain == Domain::user && channel.host == own.host && first.trace != own.trace &&
           first.tells_runs && is_so(channel);
  });
}

bool RecordingTracker::is_recorded_before(StreamIndex stream, Timestamp time,
                                          const ProcessFacts& process) const {
  const auto is_begun = [time](const CoveredWindow& window) {
    return window.begin && *window.begin <= time;
  };
  if (is_begun(window_of(stream))) return true;
  const auto* first_told = process.first_seen ? this->stream(process.first_seen->stream) : nullptr;
  const auto* own = this->stream(stream);
  return first_told != nullptr && own != nullptr && first_told->trace != own->trace &&
         is_any_other(stream, [&](const Channel& other) { return is_begun(other.window); });
}

bool RecordingTracker::is_recorded_after(StreamIndex stream, Timestamp time) const {
  const auto goes_on = [time](const CoveredWindow& window) {
    return !window.end || time <= *window.end;
  };
  if (goes_on(window_of(stream))) return true;
  return this->stream(stream) != nullptr && is_any_other(stream, [&](const Channel& other) {
           return goes_on(other.window) && !is_idle(other);
         });
}

void RecordingTracker::note_between_sessions(ProcessIndex process, const EventRef& start,
                                             Timestamp end) {
  const auto& own = model_.streams[at(start.stream)];
  user_losses_.add(own.host, start.time, end);
  const auto& window = window_of(start.stream);
  const RunsBetweenSessions run{.host = own.host,
                                .process = process,
                                .stream = start.stream,
                                .is_before = !window.begin || start.time < *window.begin,
                                .begin = start.time,
                                .end = end};
  const auto same = std::ranges::find_if(between_, [&](const RunsBetweenSessions& other) {
    return other.process == process && other.is_before == run.is_before &&
           model_.streams[at(other.stream)].trace == own.trace;
  });
  if (same == between_.end()) {
    between_.push_back(run);
    return;
  }
  same->begin = std::min(same->begin, run.begin);
  same->end = std::max(same->end, run.end);
  ++same->count;
}

// Of a process that no other session may have told of later they lie behind the last one's edge.
void RecordingTracker::finish_runs() {
  model_.between_sessions.clear();
  for (const auto& runs : between_) {
    const auto last = model_.processes[at(runs.process)].last_seen.value_or(EventRef{}).time;
    const auto is_followed = [&] {
      return is_any_other(runs.stream, [&](const Channel& other) {
        const auto& window = other.window;
        return window.begin && *window.begin <= last && (!window.end || runs.end <= *window.end);
      });
    };
    if (!runs.is_before && !is_followed()) continue;
    model_.between_sessions.push_back(runs);
    add_loss(Loss{.kind = LossKind::host_gap,
                  .host = runs.host,
                  .begin = runs.begin,
                  .end = runs.end,
                  .note = "between two sessions, runs in the window of neither"});
  }
}

}  // namespace cie::analysis
