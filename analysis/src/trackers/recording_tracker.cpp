#include "recording_tracker.hpp"

#include "model/clock_differences.hpp"
#include "model/host_gaps.hpp"

#include <algorithm>
#include <set>
#include <string_view>

namespace cie::analysis {
namespace {
constexpr std::size_t kMaxLosses = 100'000;
// Of a live system every loss is looked at again and again.
constexpr std::size_t kMaxLiveLosses = 1'000;
// Of the kernel's, so that they leave room for losses in user space, of which each one counts.
constexpr std::size_t kMaxKernelLosses = kMaxLosses / 2;
constexpr std::size_t kMaxPackets = 1'000'000;
}  // namespace

StreamFacts* RecordingTracker::stream(StreamIndex index) {
  return at(index) < model_.streams.size() ? &model_.streams[at(index)] : nullptr;
}

const StreamFacts* RecordingTracker::stream(StreamIndex index) const {
  return at(index) < model_.streams.size() ? &model_.streams[at(index)] : nullptr;
}

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
    const auto* other = states_.find(StreamIndex{static_cast<std::uint32_t>(i)});
    if (other == nullptr || other->channel == nullptr) continue;  // not begun
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
  auto& channel = channels_[event.channel];
  channel.domain = event.domain;
  channel.host = host;
  channel.streams.push_back(static_cast<std::uint32_t>(head.stream));
  facts.is_left_out = event.is_left_out;
  facts.has_inheritance = event.has_inheritance;
  facts.tells_runs = event.tells_runs.value_or(true);
  states_[head.stream].channel = &channel;
  // Of a running system nobody knows ahead.
  const bool is_silent = is_live_ && event.domain == Domain::user && !event.has_events;
  states_[head.stream].is_idle = event.has_events == false || is_silent;
  coverage_.begin(head, event, host);
  update(channel);
}

bool RecordingTracker::apply(const EventHead& head, const StreamEnd& /*event*/) {
  auto* facts = stream(head.stream);
  if (facts == nullptr) return false;
  auto& state = states_[head.stream];
  state.ended = true;
  facts->has_ended = !is_live_;
  coverage_.end(head.stream, facts->end.value_or(head.time));
  update(channels_[facts->channel]);
  const bool ends_record =
      facts->domain == Domain::user && facts->has_ended && facts->end && narrows(*facts, state);
  return ends_record && ended_traces_.emplace(facts->host, facts->trace).second;
}

std::optional<std::int32_t> RecordingTracker::apply(const EventHead& head,
                                                    const PacketBegin& event) {
  auto* facts = stream(head.stream);
  if (facts == nullptr) return std::nullopt;
  if (!event.file.empty()) {
    facts->later_files.push_back({.first_packet = facts->packets, .path = std::string(event.file)});
  }
  ++facts->packets;
  const auto begins_anew = coverage_.begin_packet(head);
  if (facts->packet_begins.size() < kMaxPackets) facts->packet_begins.push_back(head.time);
  if (facts->begin) return begins_anew;
  facts->begin = head.time;
  auto& state = states_[head.stream];
  if (state.is_idle && state.channel != nullptr && !is_live_)
    state.counted_from = state.channel->window.begin;
  update(channels_[facts->channel]);
  return begins_anew;
}

// What was counted before it began may lack events of its own.
void RecordingTracker::wake(StreamIndex index, StreamState& state) {
  state.is_idle = false;
  const auto* facts = stream(index);
  if (facts == nullptr) return;
  if (state.counted_from && facts->begin && *state.counted_from < *facts->begin) {
    add_loss(Loss{.kind = LossKind::discarded_packets,
                  .domain = facts->domain,
                  .host = facts->host,
                  .begin = *state.counted_from,
                  .end = *facts->begin,
                  .note = facts->path});
  }
  update(channels_[facts->channel]);
}

void RecordingTracker::apply(const EventHead& head, const PacketEnd& /*event*/) {
  auto* facts = stream(head.stream);
  if (facts != nullptr) facts->end = head.time;
}

bool RecordingTracker::narrows(const StreamFacts& facts, const StreamState& state) const {
  const bool is_empty = !facts.begin && (is_live_ || state.ended);
  // LTTng flushes the buffer of an idle CPU once, at the end of a chunk or the begin of the next one.
  const bool is_flush_alone = state.is_idle && facts.begin && facts.begin == facts.end;
  return !is_empty && !is_flush_alone && !facts.is_left_out;
}

CoveredWindow RecordingTracker::covered(const Channel& channel) const {
  CoveredWindow covered;
  bool has_all_begun = true;
  for (const auto index : channel.streams) {
    const auto& facts = model_.streams[index];
    const auto& state = *states_.find(StreamIndex{index});
    if (!narrows(facts, state)) continue;
    if (!facts.begin && !state.is_idle) {
      has_all_begun = false;
      continue;
    }
    if (!state.is_idle) {
      covered.begin = covered.begin ? std::max(*covered.begin, *facts.begin) : *facts.begin;
    }
    if (!is_live_ && state.ended && facts.end) {
      covered.end = covered.end ? std::min(*covered.end, *facts.end) : *facts.end;
    }
  }
  if (!has_all_begun) covered.begin.reset();
  return covered;
}

void RecordingTracker::update(Channel& channel) {
  ++changes_;
  auto& window = channel.window;
  window = covered(channel);
  if (!asked_) return;
  if (window.begin) window.begin = std::max(*window.begin, asked_->from);
  if (window.end || asked_->to != TimeWindow{}.to) {
    window.end = std::min(window.end.value_or(asked_->to), asked_->to);
  }
}

void RecordingTracker::add_loss(Loss loss) {
  const bool is_damage =
      loss.kind == LossKind::damaged_packet || loss.kind == LossKind::foreign_metadata;
  if (asked_ && !is_damage && loss.begin > asked_->to) return;
  if (asked_ && !is_damage && loss.end < asked_->from) {
    note_before(std::move(loss));
    return;
  }
  const bool is_kernel = loss.domain == Domain::kernel;
  const auto kernel_limit = is_live_ ? kMaxLiveLosses / 2 : kMaxKernelLosses;
  if (is_kernel && kernel_losses_ >= kernel_limit && merge_loss(loss)) return;
  if (model_.losses.size() >= (is_live_ ? kMaxLiveLosses : kMaxLosses)) {
    if (!merge_loss(loss)) ++model_.losses_dropped;
    return;
  }
  kernel_losses_ += is_kernel ? 1 : 0;
  model_.losses.push_back(std::move(loss));
}

void RecordingTracker::note_before(Loss loss) {
  const auto same = std::ranges::find_if(model_.losses_before, [&loss](const Loss& other) {
    return other.host == loss.host && other.domain == loss.domain;
  });
  if (same == model_.losses_before.end()) {
    model_.losses_before.push_back(std::move(loss));
  } else if (same->end < loss.end) {
    *same = std::move(loss);
  }
}

bool RecordingTracker::merge_loss(const Loss& loss) {
  const auto same = std::find_if(model_.losses.rbegin(), model_.losses.rend(), [&](const Loss& l) {
    return l.kind == loss.kind && l.host == loss.host && l.cpu == loss.cpu && l.note == loss.note &&
           l.count.has_value() == loss.count.has_value();
  });
  if (same == model_.losses.rend()) return false;
  same->begin = std::min(same->begin, loss.begin);
  same->end = std::max(same->end, loss.end);
  if (loss.count) *same->count += *loss.count;
  ++same->times;
  return true;
}

void RecordingTracker::note_user_loss(const EventHead& head, Timestamp begin, Timestamp end) {
  if (is_kernel(head.stream) || !coverage_.is_evidence(head.stream)) return;
  user_losses_.add(registry_.host_of(head), begin, end);
}

void RecordingTracker::apply(const EventHead& head, const Discarded& event) {
  note_user_loss(head, event.begin, event.end);
  const auto* facts = stream(head.stream);
  add_loss(Loss{.kind = event.packets ? LossKind::discarded_packets : LossKind::discarded_events,
                .domain = facts != nullptr ? facts->domain : Domain::user,
                .host = registry_.host_of(head),
                .begin = event.begin,
                .end = event.end,
                .count = event.count,
                .cpu = head.cpu,
                .note = facts != nullptr ? facts->path : std::string{},
                .is_evidence = coverage_.costs(head, event.end)});
}

void RecordingTracker::apply(const EventHead& head, const DamagedPacket& event) {
  const auto begin = event.begin.value_or(head.time);
  const auto end = event.end.value_or(head.time);
  if (!event.has_foreign_metadata) note_user_loss(head, begin, end);
  const auto* facts = stream(head.stream);
  add_loss(Loss{
      .kind = event.has_foreign_metadata ? LossKind::foreign_metadata : LossKind::damaged_packet,
      .domain = facts != nullptr ? facts->domain : Domain::user,
      .host = registry_.host_of(head),
      .begin = begin,
      .end = end,
      .count = std::nullopt,
      .cpu = head.cpu,
      .note = std::string(event.reason),
      .is_evidence = coverage_.costs(head, end)});
}

// Whether a process went on is known at the end alone. Who asks for losses between two events of one
// thread knows that it did.
void RecordingTracker::apply(const EventHead& head, const SessionGap& event) {
  note_user_loss(head, event.begin, event.end);
  if (model_.session_gaps.size() >= kMaxLosses) return;
  model_.session_gaps.push_back({.host = registry_.host_of(head),
                                 .from = event.begin,
                                 .to = event.end,
                                 .is_before_runs = event.is_before_runs});
}

void RecordingTracker::add_host_gaps() {
  std::erase_if(model_.losses, [](const Loss& loss) { return loss.kind == LossKind::host_gap; });
  for (const auto& gap : gaps_within_lives(model_)) {
    add_loss(Loss{.kind = LossKind::host_gap,
                  .host = gap.host,
                  .begin = gap.from,
                  .end = gap.to - Duration{1},  // the next session's first event was recorded
                  .note = "between two sessions"});
  }
}

void RecordingTracker::apply(const EventHead& head, const TimeRegression& event) {
  auto& facts = model_.time_regressions;
  ++facts.count;
  if (facts.first) return;
  facts.first = ref(head);
  facts.first_previous = event.previous;
}

bool RecordingTracker::is_kernel(StreamIndex index) const {
  return at(index) < model_.streams.size() && model_.streams[at(index)].domain == Domain::kernel;
}

bool RecordingTracker::is_idle(const Channel& channel) const {
  return std::ranges::all_of(channel.streams, [this](std::uint32_t index) {
    const auto* state = states_.find(StreamIndex{index});
    return model_.streams[index].is_left_out || (state != nullptr && state->is_idle);
  });
}

// What the channels of one trace cover together.
std::optional<Stretch> RecordingTracker::covered(
    const std::vector<const Channel*>& channels) const {
  std::optional<Stretch> all;
  auto end = kEndless;
  for (const auto* channel : channels) {
    const auto window = covered(*channel);
    if (!window.begin && !is_idle(*channel)) return std::nullopt;
    if (window.begin)
      all = Stretch{.begin = std::max(all.value_or(Stretch{*window.begin}).begin, *window.begin)};
    end = std::min(end, window.end.value_or(kEndless));
  }
  if (all) all->end = end;
  return all && all->begin <= end ? all : std::nullopt;
}

std::vector<KernelPart> RecordingTracker::kernel_parts(HostIndex host) const {
  std::map<std::uint32_t, std::vector<std::uint32_t>> traces;
  for (const auto& [number, channel] : channels_) {
    if (channel.domain != Domain::kernel || channel.host != host) continue;
    const auto first = channel.streams.front();
    if (coverage_.is_evidence(StreamIndex{first}))
      traces[model_.streams[first].trace].push_back(number);
  }
  std::vector<KernelPart> parts;
  for (const auto& [trace, numbers] : traces) {
    std::vector<const Channel*> channels;
    for (const auto number : numbers)
      channels.push_back(&channels_.at(number));
    const auto& first = model_.streams[channels.front()->streams.front()];
    parts.push_back({.has_switches = first.has_inheritance.has_value(),
                     .cpus = coverage_.cpus_of(host, numbers),
                     .covers = covered(channels)});
  }
  return parts;
}

RecordingTracker::KernelRecord& RecordingTracker::record_of(HostIndex host) const {
  auto& record = records_[host];
  const auto changes = changes_ + coverage_.changes();
  if (record.changes == changes) return record;
  record = {.changes = changes, .parts = kernel_parts(host), .of_all_cpus = {}, .of_cpu = {}};
  record.of_all_cpus = recorded(record.parts);
  record.are_cpus_alike = std::ranges::all_of(record.parts, [&record](const KernelPart& part) {
    return part.cpus == record.parts.front().cpus;
  });
  return record;
}

CoveredWindow RecordingTracker::kernel_record(HostIndex host, Timestamp time,
                                              std::optional<std::int32_t> cpu) const {
  auto& record = record_of(host);
  const auto* stretches = &record.of_all_cpus;
  if (cpu && !record.are_cpus_alike) {
    const auto [of_cpu, is_new] = record.of_cpu.try_emplace(*cpu);
    if (is_new) of_cpu->second = recorded(record.parts, cpu);
    stretches = &of_cpu->second;
  }
  const auto next = std::ranges::upper_bound(*stretches, time, {}, &Stretch::begin);
  if (next == stretches->begin()) return {};
  const auto& stretch = *std::prev(next);
  return {.begin = stretch.begin, .end = stretch.end};
}

CoveredWindow RecordingTracker::kernel_window(HostIndex host, Timestamp time,
                                              std::optional<std::int32_t> cpu) const {
  auto window = kernel_record(host, time, cpu);
  if (!asked_ || !window.begin) return window;
  window.begin = std::max(*window.begin, asked_->from);
  window.end = std::min(*window.end, asked_->to);
  return window;
}

std::optional<Timestamp> RecordingTracker::kernel_begin(HostIndex host) const {
  const auto& stretches = record_of(host).of_all_cpus;
  return stretches.empty() ? std::nullopt : std::optional(stretches.front().begin);
}

// Kernel events of a boot in which none of its machine's applications was recorded: of a machine
// that was booted anew, most likely, for its namesake's were.
bool RecordingTracker::has_foreign_kernel() const {
  std::map<std::string_view, int> namesakes;
  std::set<HostIndex> with_user_events;
  for (const auto& host : model_.hosts)
    ++namesakes[host.told];
  for (const auto& stream : model_.streams) {
    if (stream.domain == Domain::user) with_user_events.insert(stream.host);
  }
  return std::ranges::any_of(model_.streams, [&](const StreamFacts& stream) {
    return stream.domain == Domain::kernel && !with_user_events.contains(stream.host) &&
           namesakes[model_.hosts[at(stream.host)].told] > 1;
  });
}

namespace {

// What windows on one clock have in common; their hull where that is nothing, as of processes that
// ran one after the other.
class CommonWindow {
 public:
  void add(CoveredWindow window, Duration shift = {}) {
    if (window.begin) {
      const auto begin = *window.begin + shift;
      common_.begin = std::max(common_.begin.value_or(begin), begin);
      hull_.begin = std::min(hull_.begin.value_or(begin), begin);
    }
    if (window.end) {
      const auto end = *window.end + shift;
      common_.end = std::min(common_.end.value_or(end), end);
      hull_.end = std::max(hull_.end.value_or(end), end);
    }
  }
  CoveredWindow result() const {
    const bool is_common = !common_.begin || !common_.end || *common_.begin <= *common_.end;
    return is_common ? common_ : hull_;
  }
  CoveredWindow hull() const { return hull_; }

 private:
  CoveredWindow common_;
  CoveredWindow hull_;
};

// Of a recording: what the channels of a session cover together, from the first session of a machine
// to its last, and what machines have in common.
class RecordedWindow {
 public:
  void add(HostIndex host, std::uint32_t trace, CoveredWindow channel, Duration shift) {
    hosts_[host][trace].add(channel, shift);
  }
  CoveredWindow result() const {
    CommonWindow all;
    for (const auto& [host, traces] : hosts_) {
      CommonWindow sessions;
      for (const auto& [trace, channels] : traces)
        sessions.add(channels.result());
      all.add(sessions.hull());
    }
    return all.result();
  }

 private:
  std::map<HostIndex, std::map<std::uint32_t, CommonWindow>> hosts_;
};

}  // namespace

void RecordingTracker::finish() {
  coverage_.finish();
  add_host_gaps();
  model_.covered_by_any.reset();
  for (std::size_t i = 0; i < model_.streams.size(); ++i) {
    const StreamIndex index{static_cast<std::uint32_t>(i)};
    model_.streams[i].events = states_[index].events;
    model_.streams[i].is_evidence = coverage_.is_evidence(index);
    model_.streams[i].cpu = coverage_.cpu_of(index);
  }
  const bool has_user = std::any_of(channels_.begin(), channels_.end(), [](const auto& entry) {
    return entry.second.domain == Domain::user && entry.second.window.begin;
  });
  model_.clocks_unrelated = has_unrelated_clocks_ || has_foreign_kernel();
  const auto* reference = reference_host(model_);
  RecordedWindow asked_for;
  RecordedWindow recorded;
  for (const auto& [number, channel] : channels_) {
    const bool tells_runs = std::ranges::any_of(
        channel.streams, [this](std::uint32_t index) { return model_.streams[index].tells_runs; });
    model_.channels[number] = ChannelFacts{.domain = channel.domain,
                                           .host = channel.host,
                                           .begin = channel.window.begin,
                                           .end = channel.window.end,
                                           .tells_runs = tells_runs};
    if (has_user && channel.domain != Domain::user) continue;
    const auto& window = channel.window;
    if (!asked_ && window.begin && window.end && *window.begin > *window.end) {
      set_apart(channel);
      continue;
    }
    const auto shift = clock_shift(model_.hosts[at(channel.host)], *reference);
    const auto trace = model_.streams[channel.streams.front()].trace;
    if (tells_runs) add_streams_of(channel, shift);
    asked_for.add(channel.host, trace, window, shift);
    if (asked_) recorded.add(channel.host, trace, covered(channel), shift);
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

// A reader that does not know ahead what streams cover cannot leave any out.
void RecordingTracker::set_apart(const Channel& channel) {
  for (const auto index : channel.streams) {
    auto& facts = model_.streams[index];
    facts.is_apart = facts.events > 0;
    if (!facts.is_apart) continue;
    add_loss(Loss{.kind = LossKind::discarded_packets,
                  .domain = channel.domain,
                  .host = channel.host,
                  .begin = *channel.window.end,
                  .end = *channel.window.begin,
                  .note = facts.path});
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

}  // namespace cie::analysis
