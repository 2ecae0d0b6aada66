// The report: every number cie prints, as the report JSON of the contract has it. An empty optional
// is "not measured". Definitions of the quantities: analysis/README.md.
#pragma once

#include <cie/analysis/statistics.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

enum class Severity : std::uint8_t { info, loss, error };
std::string_view label(Severity severity) noexcept;

// Something about the trace itself that a reader of the numbers must know.
struct TraceDefect {
  std::string kind;  // stable, kebab-case: "discarded-events", "seq-gap", …
  Severity severity = Severity::info;
  std::uint64_t count = 0;
  std::string advice;  // what to do about it
};

// Where the releases of a callback's instances come from.
enum class ReleaseSource : std::uint8_t { exact, wakeup, source_timestamp, start, mixed };
std::string_view label(ReleaseSource source) noexcept;

struct TraceSummary {
  std::vector<std::string> paths;
  std::optional<Timestamp> begin;  // window, see definitions; empty without packets
  std::optional<Timestamp> end;
  // CLOCK_REALTIME - CLOCK_MONOTONIC as the tracer measured it; empty where the streams' clocks
  // disagree by more than a second, or have none. Not part of the JSON.
  std::optional<std::int64_t> clock_offset_ns;
  // When the earliest stream began, by CLOCK_REALTIME of its host as the tracer measured it; empty
  // if it did not. Not part of the JSON.
  std::optional<std::int64_t> begin_realtime_ns{};
  std::uint64_t events = 0;
  std::uint64_t streams = 0;
  std::vector<std::string> hosts;
  std::optional<std::uint64_t> lost_events = 0;  // empty when only packets were counted
  bool complete = false;                         // T2 to T4 pass
};

struct ProcessReport {
  std::string host;
  std::string boot_id{};     // these two of run_begin, empty and 0 without; not part of the JSON
  std::uint64_t pid_ns = 0;  // inode of its pid namespace
  bool has_ended = false;    // its run_end was seen; not part of the JSON
  std::int64_t pid = 0;
  std::string name;
  std::optional<std::string> executor;
  bool complete = false;
  std::uint32_t host_number = 0;  // as observers are told it; not part of the JSON
};

struct CallbackThread {
  std::int64_t tid = 0;
  std::string name;
  std::uint64_t instances = 0;
};

// A thread that ran on the CPU where a preempted one waited.
struct Preemptor {
  std::int64_t tid = 0;  // 0: the idle thread
  std::string name;      // the kernel's, when it ran first; may be empty
  Duration time;
};

struct CallbackReport {
  std::uint32_t index = 0;  // as Instance::callback; not part of the JSON
  std::string host{};       // in the JSON where there are several
  std::string logical_id;
  std::int64_t pid = 0;
  std::string node;
  std::string kind;
  std::string source;
  std::string symbol;
  std::optional<std::uint64_t> period_ns;
  std::optional<std::uint64_t> deadline_ns;  // that it declares itself; not part of the JSON
  std::optional<std::uint32_t> group;
  std::vector<CallbackThread> threads;  // by tid
  bool isolated = false;                // observed: one callback, one thread, both ways
  std::uint64_t instances = 0;
  std::uint64_t incomplete = 0;
  std::optional<std::uint64_t> missed_releases;
  std::optional<ReleaseSource> release_source;
  std::optional<Summary> response_time;
  std::optional<Summary> response_time_lower;
  std::optional<Summary> response_time_upper;
  std::optional<Summary> start_latency;
  std::optional<Summary> duration;
  std::optional<Summary> inter_arrival;
  std::optional<Summary> execution_time;
  std::optional<Summary> preempted;
  std::vector<Preemptor> preempted_by;  // longest first, times of all instances; a part of them
  std::optional<Summary> blocked;
  std::optional<Summary> wake_delay;
  std::optional<Summary> wakeup_latency;
  std::uint32_t host_number = 0;  // not part of the JSON
};

// Parameters last read back of a thread.
struct ThreadSchedReport {
  std::string moment;  // initial, applied, audit
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

struct ThreadReport {
  std::string host{};  // in the JSON where there are several
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  std::string name;
  std::optional<std::string> role;
  std::vector<std::string> callbacks;  // logical ids that ran on it, sorted
  std::optional<ThreadSchedReport> sched;
  std::optional<std::int64_t> busy_ns;  // on-CPU time; empty without kernel events
  std::uint32_t host_number = 0;        // not part of the JSON
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
  // went both ways; the error is negative if no constant difference explains them.
  std::optional<std::int64_t> ahead_ns{};
  std::optional<std::int64_t> error_ns{};
};

struct HopReport {
  std::string from;
  std::optional<std::string> to;  // empty for the last hop
  Summary processing;             // P - a, or F - a for the last
  std::optional<Summary> communication;
  std::optional<ClockError> clock_error{};  // of communication, between hosts
};

struct ChainReport {
  std::string name;
  std::optional<std::int64_t> pid;  // empty when it spans processes
  std::vector<std::string> hops;    // logical ids
  std::uint64_t instances = 0;
  std::optional<Summary> path_latency;
  std::optional<Summary> reaction_time;
  std::optional<Summary> data_age;
  std::optional<ClockError> clock_error{};  // of the three, if it ends on another host
  std::vector<HopReport> hop_table;
};

// One end of a message: a callback, of a process.
struct GraphNode {
  std::string logical_id;
  std::int64_t pid = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
  friend auto operator<=>(const GraphNode&, const GraphNode&) = default;
};

// Messages that a callback took from another one, as they were seen. Not part of the JSON.
struct GraphEdge {
  std::optional<GraphNode> from;  // empty: from outside any callback of the recording
  GraphNode to;
  std::string topic;
  std::uint64_t messages = 0;
  std::optional<Summary> communication;  // publish to release; empty: none was exact
  std::optional<ClockError> clock_error{};
};

struct Report {
  TraceSummary trace;
  std::vector<TraceDefect> defects;
  std::vector<ProcessReport> processes;
  std::vector<CallbackReport> callbacks;  // by pid, then creation order
  std::vector<ThreadReport> threads;      // by pid, then tid
  std::vector<ChainReport> chains;
  std::vector<HostClockReport> clocks;  // by first, then second: pairs that exchanged messages
  std::vector<GraphEdge> edges;         // the callback graph, by `to`, then `from`
};

}  // namespace cie::analysis
