// What the analysis tells observers while it goes: callback instances and messages.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace cie::analysis {

// How much of an instance lies in the window.
enum class InstanceState : std::uint8_t {
  complete,       // counted
  open,           // started, never ended: listed
  cut_by_window,  // overlaps an edge of the window or a loss: listed, not counted
};

// One run of a callback. Times are CLOCK_MONOTONIC of its host.
struct Instance {
  std::string_view logical_id;  // empty: none was told; valid as long as the analyzer
  CallbackIndex callback{};     // its row of the report, in order of creation
  ProcessIndex process{};       // likewise
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  std::uint64_t seq = 0;
  InstanceState state = InstanceState::complete;
  std::optional<CallbackStatus> status;  // empty: open, or the recording does not tell

  std::optional<Timestamp> release;  // exact, or the bound that release_source names
  ReleaseSource release_source = ReleaseSource::start;
  std::optional<Timestamp> wakeup;  // U: thread_wakeup
  std::optional<Timestamp> waking;  // W: kernel sched_waking
  Timestamp start;
  std::optional<Timestamp> end;  // empty: open
  std::optional<std::int32_t> cpu_start;
  std::optional<std::int32_t> cpu_end;
  std::optional<Duration> execution;  // the four parts: only with complete kernel events
  std::optional<Duration> preempted;
  std::optional<Duration> blocked;
  std::optional<Duration> wake_delay;
  // Who ran instead while it was preempted, in the order of their first times; the times add up to
  // `preempted`. Empty for an instance inside another one of its thread. Valid while the observer is
  // being told.
  std::span<const Preemptor> preempted_by;
  // Periods skipped before its release; of other callbacks than timers 0. Empty: not known.
  std::optional<std::uint32_t> missed = 0;
  std::optional<Duration> response_deadline;  // of its callback: the spec's, else its own

  // With writer_gid: the message taken; 0 none; below 0: a name that tells no time.
  std::int64_t source_timestamp_realtime_ns = 0;
  std::uint64_t writer_gid = 0;
  HostIndex host{};  // as ProcessReport::host_index
};

// One message, as its publisher announced it just before it was written.
struct Publication {
  Timestamp time;
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  std::optional<std::int32_t> cpu;
  std::string_view topic;
  std::uint32_t publisher_id = 0;
  std::uint64_t seq = 0;
  std::uint64_t writer_gid = 0;                   // 0 when the publisher was never announced
  std::int64_t source_timestamp_realtime_ns = 0;  // below 0: a name that tells no time
  HostIndex host{};
  ProcessIndex process{};  // as Instance::process
};

// A thread of a traced process stopped or began to run (kernel events only).
struct SchedSlice {
  std::int32_t cpu = 0;
  std::int64_t tid = 0;
  std::string_view comm;
  std::int32_t priority = 0;  // kernel scale: 99 - rt, 120 + nice, -1 deadline
  Timestamp begin;
  Timestamp end;
  std::int64_t end_state = 0;  // prev_state as the kernel wrote it
  HostIndex host{};
  // From the end of its CPU's last slice until then no event tells what ran. Empty: it was idle.
  std::optional<Timestamp> unknown_until{};
};

// A thread that waited was told to run (kernel events only): sched_waking, or sched_wakeup where
// the former was not recorded.
struct Waking {
  Timestamp time;
  std::int64_t tid = 0;
  std::int32_t priority = 0;  // kernel scale
  std::optional<std::int32_t> cpu{};
  // What ran on that CPU then: the waker, or what its interrupt came upon; 0 is the idle thread.
  std::optional<std::int64_t> waker_tid{};
  std::optional<std::int32_t> target_cpu{};
  HostIndex host{};
};

// Receives what happens in order of completion (an instance at its end), so starts are not sorted.
// A publication from before its publisher's announcement comes with that.
// Default implementations ignore.
class Observer {
 public:
  virtual ~Observer() = default;
  // A late start proves no release of a ROS 2 timer; one on time that follows proves those before it.
  // An observer that waits gets such an instance only then, or, where nothing proves its release,
  // in the end and with bounds of it; one that does not wait gets it at once, with the bounds.
  virtual bool waits_for_proof() const { return true; }
  virtual void on_instance(const Instance&) {}
  virtual void on_publication(const Publication&) {}
  virtual void on_sched_slice(const SchedSlice&) {}
  virtual void on_waking(const Waking&) {}
};

}  // namespace cie::analysis
