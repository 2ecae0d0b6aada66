// The window of each channel, as its streams begin, go on and end: what all of them cover.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/time.hpp>

#include "covered_window.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace cie::analysis {

// Streams are told of when their facts are in the model.
class ChannelWindows {
 public:
  struct Channel {
    Domain domain = Domain::user;
    HostIndex host{};
    std::vector<std::uint32_t> streams;
    CoveredWindow window;
  };

  // `asked`: every window ends there at the latest. `is_live`: see AnalysisOptions.
  ChannelWindows(Model& model, std::optional<TimeWindow> asked, bool is_live)
      : model_(model), asked_(asked), is_live_(is_live) {}

  void begin(const EventHead& head, const StreamBegin& event, HostIndex host);
  void begin_first_packet(StreamIndex index);
  void end(StreamIndex index);
  // True: it was taken for idle, so wake() is due.
  bool count_events(StreamIndex stream, std::uint64_t count) {
    auto* state = states_.find(stream);
    if (state == nullptr) return false;
    state->events += count;
    return state->is_idle;
  }
  // A stream that was taken for idle has an event after all: where it may lack earlier ones of which instances
  // were counted meanwhile.
  std::optional<Gap> wake(StreamIndex index);

  // Window of the channel that a stream belongs to.
  const CoveredWindow& window_of(StreamIndex stream) const noexcept {
    static constexpr CoveredWindow kNone{};
    const auto* state = states_.find(stream);
    return state == nullptr || state->channel == nullptr ? kNone : state->channel->window;
  }
  bool has_begun(StreamIndex stream) const noexcept {
    const auto* state = states_.find(stream);
    return state != nullptr && state->channel != nullptr;
  }
  std::uint64_t events_of(StreamIndex stream) { return states_[stream].events; }
  // What a stream, which began or ended, does not cover is missing in its channel.
  bool narrows(StreamIndex index) const;

  const std::map<std::uint32_t, Channel>& channels() const noexcept { return channels_; }
  // How often their windows may have changed.
  std::uint64_t changes() const noexcept { return changes_; }
  // What all streams of the channel cover, whatever window was asked for; empty begin: some of them have
  // not begun.
  CoveredWindow covered(const Channel& channel) const;
  // Each of its streams has no event, or is left out.
  bool is_idle(const Channel& channel) const;
  // To what any stream covers.
  void add_streams_of(const Channel& channel, Duration shift);

  // Whether sessions recorded the process before this time in this stream: the stream's own, or
  // another one that told of it before.
  bool is_recorded_before(StreamIndex stream, Timestamp time, const ProcessFacts& process) const;
  // Whether sessions record the host after it, as far as is known yet.
  bool is_recorded_after(StreamIndex stream, Timestamp time) const;
  // Whether another session than the stream's, which began by `last`, recorded the host at `end`.
  bool is_recorded_by_other(StreamIndex stream, Timestamp last, Timestamp end) const;

 private:
  struct StreamState {
    bool ended = false;
    bool is_idle = false;              // as far as known: it covers everything up to its end
    std::uint64_t events = 0;          // its facts' number, once finish() has been called
    const Channel* channel = nullptr;  // null: not begun
    // Idle as it was, it narrowed no window: instances were counted since then when it began.
    std::optional<Timestamp> counted_from;
  };
  void update(Channel& channel);
  bool narrows(const StreamFacts& facts, const StreamState& state) const;
  // Of what tells of runs on the stream's host and is of another trace, some window is so.
  template <typename IsSo>
  bool is_any_other(StreamIndex stream, const IsSo& is_so) const;

  Model& model_;
  std::optional<TimeWindow> asked_;
  bool is_live_;
  ByIndex<StreamIndex, StreamState> states_;
  std::map<std::uint32_t, Channel> channels_;
  std::uint64_t changes_ = 1;
};

}  // namespace cie::analysis
