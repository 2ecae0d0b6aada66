#include "channel_windows.hpp"

#include "model/loss_gaps.hpp"

#include <algorithm>

namespace cie::analysis {

void ChannelWindows::begin(const EventHead& head, const StreamBegin& event, HostIndex host) {
  auto& channel = channels_[event.channel];
  channel.domain = event.domain;
  channel.host = host;
  channel.streams.push_back(static_cast<std::uint32_t>(head.stream));
  states_[head.stream].channel = &channel;
  // Of a running system nobody knows ahead.
  const bool is_silent = is_live_ && event.domain == Domain::user && !event.has_events;
  states_[head.stream].is_idle = event.has_events == false || is_silent;
  update(channel);
}

void ChannelWindows::begin_first_packet(StreamIndex index) {
  auto& state = states_[index];
  if (state.is_idle && state.channel != nullptr && !is_live_)
    state.counted_from = state.channel->window.begin;
  update(channels_[model_.streams[at(index)].channel]);
}

void ChannelWindows::end(StreamIndex index) {
  states_[index].ended = true;
  update(channels_[model_.streams[at(index)].channel]);
}

// A silence is no loss: nobody says that anything was lost.
std::optional<Gap> ChannelWindows::wake(StreamIndex index) {
  auto& state = states_[index];
  state.is_idle = false;
  const auto* facts = find_stream(model_, index);
  if (facts == nullptr) return std::nullopt;
  std::optional<Gap> gap;
  if (state.counted_from && facts->begin && *state.counted_from < *facts->begin) {
    gap = edge_of(model_, index, {.from = *state.counted_from, .to = *facts->begin});
  }
  update(channels_[facts->channel]);
  return gap;
}

bool ChannelWindows::narrows(StreamIndex index) const {
  return narrows(model_.streams[at(index)], *states_.find(index));
}

bool ChannelWindows::narrows(const StreamFacts& facts, const StreamState& state) const {
  const bool is_empty = !facts.begin && (is_live_ || state.ended);
  // LTTng flushes the buffer of an idle CPU once, at the end of a chunk or the begin of the next one.
  const bool is_flush_alone = state.is_idle && facts.begin && facts.begin == facts.end;
  return !is_empty && !is_flush_alone && !facts.is_left_out;
}

CoveredWindow ChannelWindows::covered(const Channel& channel) const {
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

void ChannelWindows::update(Channel& channel) {
  ++changes_;
  auto& window = channel.window;
  window = covered(channel);
  if (!asked_) return;
  if (window.begin) window.begin = std::max(*window.begin, asked_->from);
  if (window.end || asked_->to != TimeWindow{}.to) {
    window.end = std::min(window.end.value_or(asked_->to), asked_->to);
  }
}

bool ChannelWindows::is_idle(const Channel& channel) const {
  return std::ranges::all_of(channel.streams, [this](std::uint32_t index) {
    const auto* state = states_.find(StreamIndex{index});
    return model_.streams[index].is_left_out || (state != nullptr && state->is_idle);
  });
}

void ChannelWindows::add_streams_of(const Channel& channel, Duration shift) {
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

template <typename IsSo>
bool ChannelWindows::is_any_other(StreamIndex stream, const IsSo& is_so) const {
  const auto& own = model_.streams[at(stream)];
  return std::ranges::any_of(channels_, [&](const auto& entry) {
    const auto& channel = entry.second;
    const auto& first = model_.streams[channel.streams.front()];
    return channel.domain == Domain::user && channel.host == own.host && first.trace != own.trace &&
           first.has_callback_events && is_so(channel);
  });
}

bool ChannelWindows::is_recorded_before(StreamIndex stream, Timestamp time,
                                        const ProcessFacts& process) const {
  const auto is_begun = [time](const CoveredWindow& window) {
    return window.begin && *window.begin <= time;
  };
  if (is_begun(window_of(stream))) return true;
  const auto* first_told =
      process.first_seen ? find_stream(model_, process.first_seen->stream) : nullptr;
  const auto* own = find_stream(model_, stream);
  return first_told != nullptr && own != nullptr && first_told->trace != own->trace &&
         is_any_other(stream, [&](const Channel& other) { return is_begun(other.window); });
}

bool ChannelWindows::is_recorded_after(StreamIndex stream, Timestamp time) const {
  const auto goes_on = [time](const CoveredWindow& window) {
    return !window.end || time <= *window.end;
  };
  if (goes_on(window_of(stream))) return true;
  return find_stream(model_, stream) != nullptr && is_any_other(stream, [&](const Channel& other) {
           return goes_on(other.window) && !is_idle(other);
         });
}

bool ChannelWindows::is_recorded_by_other(StreamIndex stream, Timestamp last, Timestamp end) const {
  return is_any_other(stream, [&](const Channel& other) {
    const auto& window = other.window;
    return window.begin && *window.begin <= last && (!window.end || end <= *window.end);
  });
}

}  // namespace cie::analysis
