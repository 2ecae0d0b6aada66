#include "recording_tracker.hpp"

#include "model/clock_differences.hpp"
#include "model/loss_gaps.hpp"
#include "model/stream_ends.hpp"
#include "recorded_window.hpp"

#include <algorithm>
#include <string>

namespace cie::analysis {
namespace {
constexpr std::size_t kMaxPackets = 1'000'000;
}  // namespace

void RecordingTracker::apply(const EventHead& head, const StreamBegin& event) {
  const auto host = registry_.host(event.host, event.clock_uuid);
  registry_.set_stream_host(head.stream, host);
  auto& host_facts = model_.hosts[at(host)];
  // Of the user's first stream that has one, or else of the kernel's.
  const bool has_users = std::ranges::any_of(model_.streams, [host](const StreamFacts& other) {
    return other.host == host && other.domain == Domain::user && other.clock_offset_ns != 0;
  });
  const bool is_first = event.domain == Domain::user ? !has_users : !host_facts.clock_offset_ns;
  if (is_first && event.clock_offset_ns != 0) host_facts.clock_offset_ns = event.clock_offset_ns;
  for (std::size_t i = 0; i < model_.streams.size(); ++i) {
    if (!windows_.has_begun(StreamIndex{static_cast<std::uint32_t>(i)})) continue;
    const auto& begun = model_.streams[i];
    if (begun.host == host && begun.clock_uuid != event.clock_uuid) has_unrelated_clocks_ = true;
  }
  if (at(head.stream) >= model_.streams.size()) {
    model_.streams.resize(at(head.stream) + 1);
  }
  auto& facts = model_.streams[at(head.stream)];
  facts.channel = event.channel;
  facts.trace = event.trace;
  facts.domain = event.domain;
  facts.host = host;
  facts.path = event.path;
  facts.clock_uuid = event.clock_uuid;
  facts.clock_offset_ns = event.clock_offset_ns;
  facts.writer = event.writer;
  facts.is_descriptive = event.is_descriptive;
  facts.is_left_out = event.is_left_out;
  facts.has_inheritance = event.has_inheritance;
  facts.malformed_classes = event.malformed_classes;
  facts.malformed = event.malformed;
  facts.has_callback_events = event.has_callback_events.value_or(true);
  facts.has_client_events = event.has_client_events.value_or(true);
  coverage_.begin(head, event, host);
  windows_.begin(head, event, host);
}

bool RecordingTracker::apply(const EventHead& head, const StreamEnd& /*event*/) {
  auto* facts = find_stream(model_, head.stream);
  if (facts == nullptr) return false;
  facts->has_ended = !is_live_;
  coverage_.end(head.stream, facts->end.value_or(head.time));
  windows_.end(head.stream);
  if (facts->domain != Domain::user || !facts->has_ended || !facts->end) return false;
  const bool ends_record =
      ends_apart(*facts) ? !is_any_to_end(*facts) : windows_.narrows(head.stream);
  return ends_record && ended_traces_.emplace(facts->host, facts->trace).second;
}

bool RecordingTracker::ends_apart(const StreamFacts& stream) {
  const auto [known, is_new] = ends_apart_.try_emplace(stream.trace);
  if (is_new) known->second = ends_with_last_packet(model_.recordings, stream.writer, stream.path);
  return known->second;
}

bool RecordingTracker::is_any_to_end(const StreamFacts& stream) const {
  return std::ranges::any_of(model_.streams, [&stream](const StreamFacts& other) {
    return other.trace == stream.trace && other.domain == stream.domain && !other.has_ended;
  });
}

std::optional<std::int32_t> RecordingTracker::apply(const EventHead& head,
                                                    const PacketBegin& event) {
  auto* facts = find_stream(model_, head.stream);
  if (facts == nullptr) return std::nullopt;
  if (!event.file.empty()) {
    facts->later_files.push_back({.first_packet = facts->packets, .path = std::string(event.file)});
  }
  ++facts->packets;
  const auto begins_anew = coverage_.begin_packet(head);
  if (facts->packet_begins.size() < kMaxPackets) facts->packet_begins.push_back(head.time);
  if (facts->begin) return begins_anew;
  facts->begin = head.time;
  windows_.begin_first_packet(head.stream);
  return begins_anew;
}

void RecordingTracker::apply(const EventHead& head, const PacketEnd& /*event*/) {
  auto* facts = find_stream(model_, head.stream);
  if (facts != nullptr) facts->end = head.time;
}

void RecordingTracker::wake(StreamIndex stream) {
  if (const auto gap = windows_.wake(stream)) model_.gaps.add(*gap);
}

bool RecordingTracker::is_kernel(StreamIndex index) const {
  const auto* facts = find_stream(model_, index);
  return facts != nullptr && facts->domain == Domain::kernel;
}

void RecordingTracker::note_between_sessions(ProcessIndex process, const EventRef& start,
                                             Timestamp end) {
  const auto& own = model_.streams[at(start.stream)];
  losses_.add_time(own.host, start.time, end);
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

void RecordingTracker::finish() {
  coverage_.finish();
  losses_.add_host_gaps();
  finish_streams();
  model_.clocks_unrelated = has_unrelated_clocks_ || has_foreign_kernel(model_);
  finish_window();
}

void RecordingTracker::finish_streams() {
  for (std::size_t i = 0; i < model_.streams.size(); ++i) {
    const StreamIndex index{static_cast<std::uint32_t>(i)};
    model_.streams[i].events = windows_.events_of(index);
    model_.streams[i].is_evidence = coverage_.is_evidence(index);
    model_.streams[i].cpu = coverage_.cpu_of(index);
  }
}

void RecordingTracker::finish_window() {
  for (const auto& pair : model_.pairs) {
    note_run(pair.first_start.stream, pair.first_start.time);
    note_run(pair.last_activity.stream, pair.last_activity.time);
  }
  model_.covered_by_any.reset();
  const auto& all_channels = windows_.channels();
  const bool has_user =
      std::any_of(all_channels.begin(), all_channels.end(), [](const auto& entry) {
        return entry.second.domain == Domain::user && entry.second.window.begin;
      });
  const auto* reference = reference_host(model_);
  RecordedWindow asked_for;
  RecordedWindow recorded;
  for (const auto& [number, channel] : all_channels) {
    const bool has_callback_events = std::ranges::any_of(
        channel.streams,
        [this](std::uint32_t index) { return model_.streams[index].has_callback_events; });
    model_.channels[number] = ChannelFacts{.domain = channel.domain,
                                           .host = channel.host,
                                           .begin = channel.window.begin,
                                           .end = channel.window.end,
                                           .has_callback_events = has_callback_events};
    if (has_user && channel.domain != Domain::user) continue;
    const auto& window = channel.window;
    if (!asked_ && window.begin && window.end && *window.begin > *window.end) {
      set_apart(channel);
      continue;
    }
    const auto shift = clock_shift(model_.hosts[at(channel.host)], *reference);
    const auto trace = model_.streams[channel.streams.front()].trace;
    if (has_callback_events) windows_.add_streams_of(channel, shift);
    // State counts wherever it is.
    const auto& first = model_.streams[channel.streams.front()];
    if (first.is_descriptive && (ends_apart(first) || is_outlasted(channel))) continue;
    asked_for.add(channel.host, trace, window, shift);
    if (asked_) recorded.add(channel.host, trace, windows_.covered(channel), shift);
  }
  const auto all = asked_for.result();
  model_.begin = all.begin;
  model_.end = all.end;
  if (auto& any = model_.covered_by_any; any && asked_) {
    any->from = std::max(any->from, asked_->from);
    any->to = std::min(any->to, asked_->to);
  }
  if (asked_) model_.recording_begin = recorded.result().begin;
  const bool is_known = model_.begin || asked_;
  if (!is_known && reference != nullptr) set_window_of_idle_streams(*reference);
}

void RecordingTracker::note_run(StreamIndex stream, Timestamp time) {
  auto* facts = find_stream(model_, stream);
  if (facts == nullptr) return;
  facts->first_run = std::min(facts->first_run.value_or(time), time);
  facts->last_run = std::max(facts->last_run.value_or(time), time);
}

// Instances count that lie behind its end or before its begin, in channels of their own: a consumer that
// was killed had not read it as far as those.
bool RecordingTracker::is_outlasted(const ChannelWindows::Channel& channel) const {
  const auto& window = channel.window;
  const auto is_less = [](const std::optional<Timestamp>& a, const std::optional<Timestamp>& b) {
    return a && b && *a < *b;
  };
  for (std::uint32_t i = 0; i < model_.streams.size(); ++i) {
    const auto& stream = model_.streams[i];
    if (stream.trace != model_.streams[channel.streams.front()].trace) continue;
    const auto& own = window_of(StreamIndex{i});
    const bool is_after = is_less(window.end, stream.last_run) && is_less(window.end, own.end);
    const bool is_before =
        is_less(stream.first_run, window.begin) && is_less(own.begin, window.begin);
    if (is_after || is_before) return true;
  }
  return false;
}

// A reader that does not know ahead what streams cover cannot leave any out: nothing of them counts.
void RecordingTracker::set_apart(const ChannelWindows::Channel& channel) {
  for (const auto index : channel.streams) {
    auto& facts = model_.streams[index];
    facts.is_apart = facts.events > 0;
    if (!facts.is_apart) continue;
    model_.gaps.add(
        edge_of(model_, StreamIndex{index}, {.from = kEarliest, .to = *channel.window.begin}));
    model_.gaps.add(
        edge_of(model_, StreamIndex{index}, {.from = *channel.window.end, .to = kLatest}));
  }
}

// Nothing happened in all of the recording.
void RecordingTracker::set_window_of_idle_streams(const HostFacts& reference) {
  model_.end.reset();
  for (const auto& facts : model_.streams) {
    const auto shift = clock_shift(model_.hosts[at(facts.host)], reference);
    if (facts.begin) {
      model_.begin = std::min(model_.begin.value_or(*facts.begin + shift), *facts.begin + shift);
    }
    if (facts.end)
      model_.end = std::max(model_.end.value_or(*facts.end + shift), *facts.end + shift);
  }
}

// Of a process that no other session may have told of later they lie behind the last one's edge.
void RecordingTracker::finish_runs() {
  model_.between_sessions.clear();
  for (const auto& runs : between_) {
    const auto last = model_.processes[at(runs.process)].last_seen.value_or(EventRef{}).time;
    if (!runs.is_before && !windows_.is_recorded_by_other(runs.stream, last, runs.end)) continue;
    model_.between_sessions.push_back(runs);
    losses_.add_host_gap(runs.host, runs.begin, runs.end,
                         "between two sessions, runs in the window of neither");
  }
}

}  // namespace cie::analysis
