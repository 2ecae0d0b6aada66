// The report: every number cie prints, as the report JSON of the contract has it. An empty optional
// is "not measured". Definitions of the quantities: analysis/README.md.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/rare.hpp>
#include <cie/analysis/statistics.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/recording_manifest.hpp>
#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

enum class Severity : std::uint8_t { info, loss, error };
std::string_view label(Severity severity) noexcept;

// Ways in which a trace falls short, in the order in which reports list them.
enum class DefectKind : std::uint8_t {
  damaged_manifest,
  missing_files,
  unseen_process,
  unseen_chunk,
  unseen_kernel,
  recorder_problem,
  begins_late,
  damaged_packets,
  foreign_metadata,
  malformed_classes,
  discarded_events,
  discarded_packets,
  streams_left_out,
  streams_apart,
  sched_switch_gaps,
  cpus_not_recorded,
  time_runs_backwards,
  clocks_unrelated,
  clocks_drifted,
  impossible_releases,
  host_gap,
  seq_gaps,
  publish_gaps,
  read_back_gaps,
  ends_without_start,
  repeated_ends,
  open_instances,
  instances_cut_by_window,
  instances_outside_window,
  unregistered_callbacks,
  callbacks_beside,
  unregistered_publishers,
  identity_failures,
  incomplete_chains,
  reads_not_kept,
  chains_not_listed,
  missing_run_begin,
  missing_run_end,
  shared_pid,
  contract_too_new
};
// Stable, kebab-case: "discarded-events", "seq-gaps", ….
std::string_view label(DefectKind kind) noexcept;

// Something about the trace itself that a reader of the numbers must know.
struct TraceDefect {
  DefectKind kind{};
  Severity severity = Severity::info;
  std::uint64_t count = 0;
  std::string advice;  // what to do about it
};

// Where the releases of a callback's instances come from. timer_grid: calculated from when a timer
// of ROS 2 was made, at most kTimerError too early if it was never reset.
enum class ReleaseSource : std::uint8_t {
  exact,
  timer_grid,
  wakeup,
  source_timestamp,
  start,
  mixed
};
// Whether such a release is known and not merely bounded.
constexpr bool is_known(ReleaseSource source) noexcept {
  return source == ReleaseSource::exact || source == ReleaseSource::timer_grid;
}
inline constexpr Duration kTimerError{10'000};
// A timer that was reset unnoticed has releases that are off by no more than this.
inline constexpr Duration kMostTimerError{1'000'000};
std::string_view label(ReleaseSource source) noexcept;

// Whether a callback had a thread of its own: every run of it on one thread, which ran nothing
// else.
enum class Isolation : std::uint8_t { isolated, not_isolated, never_ran };
std::string_view label(Isolation isolation) noexcept;

// What is recorded and not in the window that all streams cover, where nobody asked for another one.
struct OutsideWindow {
  std::uint64_t instances = 0;  // no part of which is in it
  Duration length;              // of what some streams cover and others do not
};

struct TraceSummary {
  std::vector<std::string> paths;
  std::optional<Timestamp> begin;  // window, see definitions; empty without packets
  std::optional<Timestamp> end;
  // Begin of the recording where a window of it was asked for. Not part of the JSON.
  std::optional<Timestamp> recording_begin{};
  // CLOCK_REALTIME - CLOCK_MONOTONIC as the tracer measured it; empty where the streams' clocks
  // disagree by more than a second, or have none.
  std::optional<std::int64_t> clock_offset_ns;
  // When the earliest stream began, by CLOCK_REALTIME of its host as the tracer measured it; empty
  // if it did not. Not part of the JSON.
  std::optional<std::int64_t> begin_realtime_ns{};
  // Empty where no instance is. In a document of its own, behind the trace.
  std::optional<OutsideWindow> outside{};
  std::uint64_t events = 0;
  std::uint64_t streams = 0;
  std::vector<std::string> hosts;
  std::optional<std::uint64_t> lost_events = 0;  // empty: nobody knows, as of whole packets
  // T2 to T4 pass, nothing of a manifest is missing, and it is there from its first chunk on.
  bool complete = false;

  // What "+1.500 s" is said from, with a window and without.
  std::optional<Timestamp> zero() const { return recording_begin ? recording_begin : begin; }
};

// A host: its clock, and how long it was recorded; not part of the JSON.
struct HostReport {
  std::string name;
  std::optional<std::int64_t> clock_offset_ns{};  // CLOCK_REALTIME - CLOCK_MONOTONIC
  // To a time of its CLOCK_MONOTONIC for one of the clock of TraceSummary::begin, as far as their
  // wall clocks agree.
  Duration shift{};
  std::optional<Duration> recorded{};  // how long it was; empty: not known
};

// Messages of one publisher that reached nobody: they were not sent in time.
struct UnsentMessages {
  std::string node;  // empty: not known
  std::string topic;
  std::uint64_t messages = 0;
};

// The one place of a process's host and pid: other rows name it by its number. Report::hosts
// describes the host itself.
struct ProcessReport {
  ProcessIndex index{};
  std::string host;
  // These two are of run_begin, empty and 0 without; not part of the JSON.
  std::string boot_id{};
  std::uint64_t pid_ns = 0;  // inode of its pid namespace
  bool has_ended = false;    // its run_end was seen; not part of the JSON
  // From its run_begin to its run_end, where they were seen; not part of the JSON.
  TimeWindow lived{};
  bool may_hide_callbacks = false;  // of which no event was seen; not part of the JSON
  std::int64_t pid = 0;
  // Of several processes that had this pid, how many had it up to this one, as where one executes
  // another program. 0: it alone had it. Not part of the JSON, where `index` tells them apart.
  std::uint32_t program = 0;
  std::string name;
  std::optional<std::string> executor;
  bool complete = false;
  // Of a process that only ROS 2's events describe; empty: another process, or not known.
  std::optional<std::string> tracetools{};  // their version
  std::optional<bool> tells_messages{};     // whether which one a callback took; none took any
  HostIndex host_index{};                   // as observers are told it; not part of the JSON
  // Of its first event and each run_begin; not part of the JSON.
  std::vector<std::uint32_t> traces{};
  // Publications by topic, as far as it is known; not part of the JSON.
  std::map<std::string, std::uint64_t> published{};
  // By publisher, in the order of their ids. Empty: none was seen.
  std::optional<std::vector<UnsentMessages>> unsent{};
};

struct CallbackThread {
  ThreadIndex thread{};
  std::int64_t tid = 0;
  std::string name;
  std::uint64_t instances = 0;
};

// A thread that ran on the CPU where a preempted one waited. The idle one preempts nobody: the kernel
// let the other not run (it was throttled), or had not switched yet.
struct Preemptor {
  std::int64_t tid = 0;  // 0: the idle thread
  std::string name;      // the kernel's, when it ran first; may be empty
  Duration time;
  Duration in_callbacks{};  // of that, while it ran one; not part of the JSON

  bool is_idle() const noexcept { return tid == 0; }
};

// What of a response time was not execution. Empty: not measured.
struct ResponseParts {
  std::optional<Duration> start_latency{};
  std::optional<Duration> preempted{};
  std::optional<Duration> preempted_outside{};  // of that, by threads that ran no callback then
  std::optional<Duration> wake_delay{};
};

// An instance that did not end.
struct OpenRun {
  std::uint64_t seq = 0;
  // From its start to the end of the recording; of a system that runs, to its process's last event.
  Duration until_end;
  // From its release, where that is known, to there; empty unless totals prove that it did not end or,
  // in a system that runs, nothing tells that its end may be missing.
  std::optional<Duration> response_least{};
};

struct CallbackReport {
  CallbackIndex index{};  // as Instance::callback
  ProcessIndex process{};
  std::string logical_id;
  // From 1: of the callbacks of its process that had this id, as where a node is destroyed and created
  // again, how many up to this one. Not part of the JSON, where `index` tells them apart.
  std::uint32_t lifetime = 1;
  std::string node;
  std::optional<CallbackKind> kind;  // empty: never registered
  std::string source;
  std::string symbol;
  std::optional<std::uint64_t> period_ns;
  std::optional<std::uint64_t> deadline_ns;   // that it declares itself
  std::optional<Duration> response_deadline;  // that it has to keep: the spec's, else its own
  std::optional<std::uint64_t> late;  // instances certainly beyond it; empty without a deadline
  std::optional<std::uint32_t> group;
  bool shares_group = false;            // one that runs no two at a time; not part of the JSON
  std::vector<CallbackThread> threads;  // by tid
  // As observed. Empty: it is not known.
  std::optional<Isolation> isolation = Isolation::never_ran;
  std::uint64_t instances = 0;
  std::uint64_t incomplete = 0;  // open at the end
  std::uint64_t cut = 0;         // by an edge of the window
  // That the recording proves and does not show: before it began, outside the window, or lost.
  std::uint64_t runs_not_seen = 0;
  // How many of these are recorded, where not all streams are. Empty: none.
  std::optional<std::uint64_t> outside_window{};
  bool may_lack_runs = false;  // some in the recording were perhaps not seen; not part of the JSON
  // The longest that a run may have executed or been blocked for of which that is not known, cut
  // ones included. Empty: it is known of all that ended. Not part of the JSON.
  std::optional<Duration> longest_unmeasured{};
  Rare<OpenRun> longest_open{};              // of those that are open; not part of the JSON
  std::optional<std::uint64_t> late_open{};  // of those, certainly beyond the deadline. Empty: none
  // From its callback_init, unless that repeats what may be older, to its callback_fini, where they were
  // seen; not part of the JSON.
  TimeWindow lived{};
  // Between known releases that came in order, those of open runs included; not part of the JSON.
  std::optional<Duration> shortest_inter_arrival{};
  std::optional<std::uint64_t> exceptions;  // instances that one ended; empty: not told
  std::optional<std::uint64_t> missed_releases;
  // Of a subscription: the most samples that waited at once, arrived and not overwritten, for their
  // instance to start.
  std::optional<std::uint64_t> longest_queue;
  // Samples lost since the process counts: before the queue; in it, by later ones. Empty: not told.
  std::optional<std::uint64_t> lost_samples{};
  std::optional<std::uint64_t> overwritten_samples{};
  // At least so many were overwritten: cie_rclcpp lacks some. Empty: it is the number.
  std::optional<bool> is_overwritten_at_least{};
  // How many of these, at most, were counted before the recording was attached. Empty: none.
  std::optional<std::uint64_t> lost_before{};
  std::optional<std::uint64_t> overwritten_before{};
  std::optional<ReleaseSource> release_source;
  // By how much calculated releases may be early, had a reset of the timer moved them unnoticed:
  // what all of some consecutive starts lie behind them. Empty: there are none.
  std::optional<Duration> release_error{};
  Rare<Summary> response_time;
  ResponseParts longest_response{};  // of the longest of these; not part of the JSON
  Rare<Summary> response_time_lower;
  Rare<Summary> response_time_upper;
  // Of all instances, those of `response_time` and of `response_time_lower`: no quantile of the
  // response time is below this one's. Empty unless there are both.
  Rare<Summary> response_time_at_least{};
  // Whether its median is the response time's: whatever the instances took whose release is not
  // known, that lies within a bucket of it. Empty where it is.
  std::optional<bool> is_median_known{};
  Rare<Summary> start_latency;
  Rare<Summary> duration;
  Rare<Summary> inter_arrival;
  Rare<Summary> execution_time;
  Rare<Summary> preempted;
  // Of an instance, by threads that ran no callback then; not part of the JSON. Empty: not measured.
  std::optional<Duration> longest_preempted_outside{};
  // Longest first, times of all instances. What these lack of `preempted` others took.
  std::vector<Preemptor> preempted_by;
  Rare<Summary> blocked;
  Rare<Summary> wake_delay;
  Rare<Summary> wakeup_latency;

  bool is_isolated() const noexcept { return isolation == Isolation::isolated; }
  // Those of which a part was seen.
  std::uint64_t partly_seen() const noexcept { return incomplete + cut; }
  // Whether a part of an instance was seen.
  bool has_run() const noexcept { return instances + partly_seen() > 0; }
  // No instance was seen, and nothing proves that there was one.
  bool never_ran() const noexcept { return !has_run() && runs_not_seen == 0; }
  // Response times of all instances, with the lower bounds of those whose release is not known.
  const Rare<Summary>& response_time_or_bound() const noexcept {
    if (response_time_at_least) return response_time_at_least;
    return response_time ? response_time : response_time_lower;
  }
};

// Parameters of a thread, as they were read back.
struct ThreadSchedReport {
  std::optional<SchedMoment> moment{};
  std::int32_t policy = 0;
  std::string policy_name;  // "SCHED_FIFO"; empty if unknown
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
  std::vector<std::uint32_t> cpus;
  std::int32_t error = 0;
  // These three where they are not what the thread began with: somebody asked for them.
  std::optional<std::uint64_t> slice_ns{};
  std::optional<std::uint32_t> util_min{};  // of 1024
  std::optional<std::uint32_t> util_max{};
};

// How sched_switch shows a thread that nobody read back. Inherited priorities are left out.
struct ThreadSwitchedReport {
  std::int32_t prio =
      0;               // at its last switch, the kernel's: 99 - real-time priority, 120 + nice, -1
  std::string text{};  // "real-time priority 20", "nice 5"
  std::uint64_t changes = 0;  // of it, before
};

struct ThreadReport {
  ThreadIndex index{};
  ProcessIndex process{};
  std::int64_t tid = 0;
  std::string name;
  std::optional<ThreadRole> role;
  std::vector<std::string> callbacks;  // logical ids that ran on it, sorted
  std::vector<CallbackIndex> ran{};    // the same by their numbers, in that order
  std::optional<ThreadSchedReport> sched;
  std::optional<ThreadSwitchedReport> switched{};  // where `sched` is empty, as far as it was seen
  // What S1 judges, applied before that, if anything was; not part of the JSON.
  std::optional<ThreadSchedReport> applied{};
  // What else its callbacks ran as before `sched`, as far as it was read back; not part of the JSON.
  std::vector<ThreadSchedReport> former{};
  // It may have run with others, too: some may be missing; the kernel shows a priority or a CPU that
  // none of them tells. Neither is part of the JSON.
  bool may_lack_read_backs = false;
  bool is_contradicted = false;
  std::optional<std::int64_t> busy_ns;  // on-CPU time; empty: not recorded without a hole
};

// The true length of a time span between two hosts is what their clocks show plus something within
// these bounds. An empty one: there is no such bound, because no message went that way.
struct ClockError {
  std::optional<Duration> least;
  std::optional<Duration> most;

  // Both bounds are there and contradict each other: the clocks did not keep one distance.
  bool is_contradiction() const noexcept { return least && most && *least > *most; }
};

// Two hosts that exchanged messages. The estimate halves the fastest messages' round trip.
struct HostClockReport {
  std::string first;
  std::string second;
  std::uint64_t messages_there = 0;  // from the first to the second
  std::uint64_t messages_back = 0;
  std::optional<std::int64_t> fastest_there_ns{};  // as the clocks show
  std::optional<std::int64_t> fastest_back_ns{};
  // By how much the second's clock is ahead, and how far that may be wrong: empty unless messages
  // went both ways, and where one of the clocks was set meanwhile. The error is negative if no
  // constant difference explains them.
  std::optional<std::int64_t> ahead_ns{};
  std::optional<std::int64_t> error_ns{};
};

struct HopReport {
  std::string from;
  std::optional<std::string> to;  // empty for the last hop
  // The two as ChainReport::callbacks has them; empty without an instance.
  std::optional<CallbackIndex> from_callback{};
  std::optional<CallbackIndex> to_callback{};
  Rare<Summary> processing;                 // P - a, or F - a for the last; empty: no release known
  Rare<Summary> communication;              // empty also for the last
  std::optional<ClockError> clock_error{};  // of communication, between hosts
  // What ROS 2's events tell, by starts in place of releases.
  Rare<Summary> start_to_publish{};  // to the end for the last
  Rare<Summary> publish_to_start{};  // empty also for the last
};

struct ChainReport {
  ChainIndex index{};
  std::string name;
  std::optional<ProcessIndex> process{};   // empty when it spans several, or never ran
  std::vector<std::string> hops;           // logical ids
  std::vector<CallbackIndex> callbacks{};  // of each hop, in its last instance; empty without one
  bool is_specified = false;  // by the scheduling spec; listed even without an instance
  std::uint64_t instances = 0;
  Rare<Summary> path_latency;
  Rare<Summary> reaction_time;
  Rare<Summary> data_age;
  // What ROS 2's events tell: from the first callback's start, which is at least the latency and
  // the sum of start_to_publish and publish_to_start; and from what its release was not before.
  Rare<Summary> from_start{};
  Rare<Summary> path_latency_upper{};
  // From when the response of the service that ends the chain was sent to when the client took it.
  Rare<Summary> response{};
  std::optional<ClockError> clock_error{};  // of the three, if it ends on another host
  // The sums of its cells and of what is undivided add up to the path latency's.
  std::vector<HopReport> hop_table;
  // Where a release of an instance is unknown: from the publish before it to the one after it.
  Rare<Summary> undivided{};
};

// Messages that a callback took from another one, as they were seen.
struct GraphEdge {
  // Empty: from outside any callback of the recording, or nothing tells who published.
  std::optional<CallbackIndex> from;
  CallbackIndex to{};
  std::string topic;
  std::uint64_t messages = 0;
  // Of these, where `from` is empty: whose publication was not recorded, as that of writers of other
  // applications. Empty: none.
  std::optional<std::uint64_t> unrecorded{};
  Rare<Summary> communication;       // publish to release; empty: none was exact
  Rare<Summary> publish_to_start{};  // of what ROS 2's events tell
  std::optional<ClockError> clock_error{};
};

// What a recording of `cie record` says of itself.
struct RecordingReport {
  std::string path;  // its directory, as it was named
  std::string host;
  std::vector<std::string> command;          // empty: attached
  std::optional<RecordedExit> exit;          // of the command; empty: attached, or it still ran
  bool has_kernel_events = false;            // that it was to hold
  std::optional<std::uint64_t> first_chunk;  // of those that are here; empty: not in chunks
  RecordedInstant begin;                     // of what is here
  RecordedInstant end{};                     // likewise; not part of the JSON
  std::vector<std::string> problems;         // why it is not what was asked for
};

struct Report {
  TraceSummary trace;
  std::vector<TraceDefect> defects;
  std::vector<ProcessReport> processes;
  std::vector<CallbackReport> callbacks;  // by host, pid, then creation order
  std::vector<ThreadReport> threads;      // by host, pid, then tid
  std::vector<ChainReport> chains;
  std::vector<HostReport> hosts{};      // by HostIndex
  std::vector<HostClockReport> clocks;  // by first, then second: pairs that exchanged messages
  // The callback graph: by logical id, then pid of `to`, then of `from`.
  std::vector<GraphEdge> edges;
  std::vector<RecordingReport> recordings{};  // those with a manifest, by path
};

}  // namespace cie::analysis
