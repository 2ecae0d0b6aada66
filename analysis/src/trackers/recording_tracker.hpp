// Streams and packets, and what follows from them: the window of each channel (channel_windows), what was
// lost (loss_log), and when the kernel was recorded (kernel_coverage, kernel_records).
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/time.hpp>

#include "channel_windows.hpp"
#include "covered_window.hpp"
#include "kernel_coverage.hpp"
#include "kernel_records.hpp"
#include "loss_log.hpp"
#include "model/facts.hpp"
#include "model/loss_times.hpp"
#include "registry.hpp"

#include <cstdint>
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
      : model_(model),
        registry_(registry),
        coverage_(model),
        windows_(model, asked, is_live),
        losses_(model, registry, coverage_, asked, is_live),
        kernel_(model, windows_, coverage_, asked),
        asked_(asked),
        is_live_(is_live) {}

  void apply(const EventHead& head, const StreamBegin& event);
  // True: it is the first stream in user space of its trace to end, from where on something may be
  // missing in that.
  bool apply(const EventHead& head, const StreamEnd& event);
  // The CPU of which the kernel's record begins anew, some time after that of another trace ended.
  std::optional<std::int32_t> apply(const EventHead& head, const PacketBegin& event);
  void apply(const EventHead& head, const PacketEnd& event);
  void apply(const EventHead& head, const Discarded& event) { losses_.apply(head, event); }
  void apply(const EventHead& head, const DamagedPacket& event) { losses_.apply(head, event); }
  void apply(const EventHead& head, const SessionGap& event) { losses_.apply(head, event); }
  void apply(const EventHead& head, const TimeRegression& event) { losses_.apply(head, event); }
  void add_loss(Loss loss) { losses_.add(std::move(loss)); }
  void count_events(StreamIndex stream, std::uint64_t count) {
    if (windows_.count_events(stream, count)) [[unlikely]]
      wake(stream);
  }

  // Window of the channel that a stream belongs to.
  const CoveredWindow& window_of(StreamIndex stream) const noexcept {
    return windows_.window_of(stream);
  }
  // All of that time is in the window that was asked for, if any was.
  bool is_asked_for(Timestamp from, Timestamp to) const noexcept {
    return !asked_ || (asked_->from <= from && to <= asked_->to);
  }
  // Whether sessions recorded the process before this time in this stream: the stream's own, or
  // another one that told of it before.
  bool is_recorded_before(StreamIndex stream, Timestamp time, const ProcessFacts& process) const {
    return windows_.is_recorded_before(stream, time, process);
  }
  // Whether sessions record the host after it, as far as is known yet.
  bool is_recorded_after(StreamIndex stream, Timestamp time) const {
    return windows_.is_recorded_after(stream, time);
  }
  // A run that lies there, and in no window, and has no number: others may have been lost.
  void note_between_sessions(ProcessIndex process, const EventRef& start, Timestamp end);
  // The time around `time` in which the kernel's traces that are evidence cover all of the host's CPUs, or
  // this one. Empty begin: they do not at that time, or are none.
  CoveredWindow kernel_window(HostIndex host, Timestamp time,
                              std::optional<std::int32_t> cpu = {}) const {
    return kernel_.window(host, time, cpu);
  }
  // The same, whatever window was asked for: before and after it some CPU's record is missing.
  CoveredWindow kernel_record(HostIndex host, Timestamp time,
                              std::optional<std::int32_t> cpu = {}) const {
    return kernel_.record(host, time, cpu);
  }
  // When it began to cover all of the host's CPUs; empty: it does not yet.
  std::optional<Timestamp> kernel_begin(HostIndex host) const { return kernel_.begin(host); }
  bool has_kernel(HostIndex host) const noexcept { return coverage_.has_kernel(host); }
  KernelCoverage& coverage() noexcept { return coverage_; }
  const KernelCoverage& coverage() const noexcept { return coverage_; }
  bool is_kernel(StreamIndex stream) const;
  // Of the streams of applications that are evidence.
  const LossTimes& loss_times() const noexcept { return losses_.times(); }
  // A callback starts or ends. Who has the model's pairs need not tell: they do.
  void note_run(StreamIndex stream, Timestamp time);
  void finish();
  // After that, and when all instances were measured.
  void finish_runs();

 private:
  // A stream that was taken for idle has an event after all.
  void wake(StreamIndex stream);
  // It tells of state alone, and does not cover all instances that count.
  bool is_outlasted(const ChannelWindows::Channel& channel) const;
  // See ends_with_last_packet().
  bool ends_apart(const StreamFacts& stream);
  // Of the streams of its trace.
  bool is_any_to_end(const StreamFacts& stream) const;
  void finish_streams();
  void finish_window();
  void set_apart(const ChannelWindows::Channel& channel);
  void set_window_of_idle_streams(const HostFacts& reference);

  Model& model_;
  Registry& registry_;
  KernelCoverage coverage_;
  ChannelWindows windows_;
  LossLog losses_;
  KernelRecords kernel_;
  std::optional<TimeWindow> asked_;
  bool is_live_;
  bool has_unrelated_clocks_ = false;           // streams of one host disagree about the boot
  std::vector<RunsBetweenSessions> between_{};  // whether or not another session follows
  std::set<std::pair<HostIndex, std::uint32_t>> ended_traces_;  // of user space
  std::map<std::uint32_t, bool> ends_apart_;                    // by trace
};

}  // namespace cie::analysis
