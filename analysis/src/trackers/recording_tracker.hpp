// Streams, packets and what the tracer lost: yields the window of each channel as it becomes known.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/time.hpp>

#include "covered_window.hpp"
#include "kernel_coverage.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/kernel_record.hpp"
#include "model/loss_times.hpp"
#include "registry.hpp"

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace cie::analysis {

class RecordingTracker {
 public:
  // `asked`: every channel's window ends there at the latest, and losses elsewhere are no losses of it.
  // `is_live`: see AnalysisOptions.
  RecordingTracker(Model& model, Registry& registry, std::optional<TimeWindow> asked = {},
                   bool is_live = false)
      : model_(model), registry_(registry), coverage_(model), asked_(asked), is_live_(is_live) {}

  void apply(const EventHead& head, const StreamBegin& event);
  // True: it is the first stream in user space of its trace to end, from where on something may be
  // missing in that.
  bool apply(const EventHead& head, const StreamEnd& event);
  // The CPU of which the kernel's record begins anew, some time after that of another trace ended.
  std::optional<std::int32_t> apply(const EventHead& head, const PacketBegin& event);
  void apply(const EventHead& head, const PacketEnd& event);
  void apply(const EventHead& head, const Discarded& event);
  void apply(const EventHead& head, const DamagedPacket& event);
  void apply(const EventHead& head, const SessionGap& event);
  void apply(const EventHead& head, const TimeRegression& event);
  void add_loss(Loss loss);
  void count_events(StreamIndex stream, std::uint64_t count) {
    auto* state = states_.find(stream);
    if (state == nullptr) return;
    state->events += count;
    if (state->is_idle) [[unlikely]]
      wake(stream, *state);
  }

  // Window of the channel that a stream belongs to.
  const CoveredWindow& window_of(StreamIndex stream) const noexcept {
    static constexpr CoveredWindow kNone{};
    const auto* state = states_.find(stream);
    return state == nullptr || state->channel == nullptr ? kNone : state->channel->window;
  }
  // All of that time is in the window that was asked for, if any was.
  bool is_asked_for(Timestamp from, Timestamp to) const noexcept {
    return !asked_ || (asked_->from <= from && to <= asked_->to);
  }
  // Whether sessions recorded the process before this time in this stream: the stream's own, or
  // another one that told of it before.
  bool is_recorded_before(StreamIndex stream, Timestamp time, const ProcessFacts& process) const;
  // Whether sessions record the host after it, as far as is known yet.
  bool is_recorded_after(StreamIndex stream, Timestamp time) const;
  // A run that lies there, and in no window, and has no number: others may have been lost.
  void note_between_sessions(ProcessIndex process, const EventRef& start, Timestamp end);
  // The time around `time` in which the kernel's traces that are evidence cover all of the host's CPUs, or
  // this one. Empty begin: they do not at that time, or are none.
  CoveredWindow kernel_window(HostIndex host, Timestamp time,
                              std::optional<std::int32_t> cpu = {}) const;
  // The same, whatever window was asked for: before and after it some CPU's record is missing.
  CoveredWindow kernel_record(HostIndex host, Timestamp time,
                              std::optional<std::int32_t> cpu = {}) const;
  // When it began to cover all of the host's CPUs; empty: it does not yet.
  std::optional<Timestamp> kernel_begin(HostIndex host) const;
  bool has_kernel(HostIndex host) const noexcept { return coverage_.has_kernel(host); }
  KernelCoverage& coverage() noexcept { return coverage_; }
  const KernelCoverage& coverage() const noexcept { return coverage_; }
  bool is_kernel(StreamIndex stream) const;
  // Of the streams of applications that are evidence.
  const LossTimes& user_losses() const noexcept { return user_losses_; }
  void finish();
  // After that, and when all instances were measured.
  void finish_runs();

 private:
  struct Channel {
    Domain domain = Domain::user;
    HostIndex host{};
    std::vector<std::uint32_t> streams;
    CoveredWindow window;
  };
  struct KernelRecord {
    std::uint64_t changes = 0;  // of channels and of their CPUs, when it was found out
    std::vector<KernelPart> parts;
    std::vector<Stretch> of_all_cpus;
    bool are_cpus_alike = true;  // each part has the same
    std::map<std::int32_t, std::vector<Stretch>> of_cpu;
  };
  struct StreamState {
    bool ended = false;
    bool is_idle = false;              // as far as known: it covers everything up to its end
    std::uint64_t events = 0;          // its facts' number, once finish() has been called
    const Channel* channel = nullptr;  // null: not begun
    // Idle as it was, it narrowed no window: instances were counted since then when it began.
    std::optional<Timestamp> counted_from;
  };
  StreamFacts* stream(StreamIndex index);
  const StreamFacts* stream(StreamIndex index) const;
  // A stream that was taken for idle has an event after all.
  void wake(StreamIndex index, StreamState& state);
  bool has_foreign_kernel() const;
  void update(Channel& channel);
  // What the stream does not cover is missing in its channel.
  bool narrows(const StreamFacts& facts, const StreamState& state) const;
  // What all streams of the channel cover; empty begin: some of them have not begun.
  CoveredWindow covered(const Channel& channel) const;
  KernelRecord& record_of(HostIndex host) const;
  std::vector<KernelPart> kernel_parts(HostIndex host) const;
  std::optional<Stretch> covered(const std::vector<const Channel*>& channels) const;
  // Of what tells of runs on the stream's host and is of another trace, some window is so.
  template <typename IsSo>
  bool is_any_other(StreamIndex stream, const IsSo& is_so) const;
  // Each of its streams has no event, or is left out.
  bool is_idle(const Channel& channel) const;
  void set_apart(const Channel& channel);
  // To what any stream covers.
  void add_streams_of(const Channel& channel, Duration shift);
  void add_host_gaps();
  void set_window_of_idle_streams(const HostFacts& reference);
  void note_user_loss(const EventHead& head, Timestamp begin, Timestamp end);
  // It was over when the window that was asked for began.
  void note_before(Loss loss);
  // Adds it to a loss of its kind and place; false if there is none.
  bool merge_loss(const Loss& loss);

  Model& model_;
  Registry& registry_;
  KernelCoverage coverage_;
  LossTimes user_losses_;
  std::optional<TimeWindow> asked_;
  bool is_live_;
  bool has_unrelated_clocks_ = false;  // streams of one host disagree about the boot
  ByIndex<StreamIndex, StreamState> states_;
  std::size_t kernel_losses_ = 0;               // in the model
  std::vector<RunsBetweenSessions> between_{};  // whether or not another session follows
  std::map<std::uint32_t, Channel> channels_;
  std::uint64_t changes_ = 1;                                   // of the channels' windows
  std::set<std::pair<HostIndex, std::uint32_t>> ended_traces_;  // of user space
  mutable ByIndex<HostIndex, KernelRecord> records_{};          // found out when somebody asks
};

}  // namespace cie::analysis
