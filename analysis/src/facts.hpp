// The facts a trace gives about its processes, threads, callbacks and messages: plain data, filled
// by the trackers in one pass, read by the rules and the report. Bounded: per subject, never per
// instance. Indices are dense and stable; vectors of Model are in order of first appearance, which
// is not an order to print in.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/statistics.hpp>
#include <cie/tracepoints/schema.hpp>

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cie::analysis {

enum class HostIndex : std::uint32_t {};
enum class ProcessIndex : std::uint32_t {};
enum class ThreadIndex : std::uint32_t {};
enum class CallbackIndex : std::uint32_t {};

template <typename Index>
constexpr std::size_t at(Index index) noexcept {
  return static_cast<std::size_t>(index);
}

// Where and when an event happened: what evidence is made of.
struct EventRef {
  Timestamp time{};
  std::optional<std::int32_t> cpu{};
  std::optional<std::int64_t> pid{};
  std::optional<std::int64_t> tid{};
};
inline EventRef ref(const EventHead& head) noexcept {
  return {head.time, head.cpu, head.pid, head.tid};
}

// --- the recording -------------------------------------------------------------------------------
struct StreamFacts {
  std::uint32_t channel = 0;
  Domain domain = Domain::user;
  HostIndex host{};
  std::string path{};
  std::string clock_uuid{};
  std::int64_t clock_offset_ns = 0;
  std::optional<Timestamp> begin{};  // first packet's begin
  std::optional<Timestamp> end{};    // last packet's end
  std::uint64_t packets = 0;
  std::uint64_t events = 0;
};

// Window of a channel: [latest first-packet begin, earliest last-packet end] over its streams.
struct ChannelFacts {
  Domain domain = Domain::user;
  HostIndex host{};
  std::optional<Timestamp> begin{};
  std::optional<Timestamp> end{};
};

enum class LossKind : std::uint8_t {
  discarded_events,
  discarded_packets,
  damaged_packet,
  switch_mismatch  // a sched_switch whose prev_tid is not the CPU's last next_tid
};
struct Loss {
  LossKind kind = LossKind::discarded_events;
  Domain domain = Domain::user;
  HostIndex host{};
  Timestamp begin{};
  Timestamp end{};
  std::optional<std::uint64_t> count{};  // events or packets; empty: unknown
  std::optional<std::int32_t> cpu{};
  std::string note{};  // stream, reason
};

struct HostFacts {
  std::string name{};
  std::string clock_uuid{};
  bool has_switches = false;  // kernel events by class
  bool has_wakings = false;
  bool has_forks = false;
};

// --- state ---------------------------------------------------------------------------------------
struct RunTotals {
  EventRef at{};
  std::uint32_t callbacks = 0;
  std::uint32_t threads = 0;
  std::uint32_t groups = 0;
  std::uint32_t publishers = 0;
  std::int32_t status = 0;
};

// One process incarnation: (host, pid, process start).
struct ProcessFacts {
  HostIndex host{};
  std::int64_t pid = 0;
  std::optional<EventRef> run_begin{};  // first one seen
  std::optional<RunMoment> first_moment{};
  std::string executor{};
  std::string boot_id{};
  std::string spec_sha256{};
  std::string tool_version{};
  std::optional<std::int64_t> start_ns{};
  std::uint64_t pid_ns = 0;
  std::uint32_t contract_version = 0;
  std::uint32_t online_cpus = 0;
  std::optional<RunTotals> run_end{};    // last one seen
  std::optional<EventRef> first_seen{};  // any event of this pid
  std::optional<EventRef> last_seen{};
  std::uint64_t announcements = 0;  // run_begin of moment announce
  bool has_cie_events = false;  // anything but clock_sync; others are not processes of the report
  std::string name{};           // command name where known
};

struct NodeFacts {
  ProcessIndex process{};
  NodeId id{};
  std::string name{};
};

struct GroupFacts {
  ProcessIndex process{};
  GroupId id{};
  std::optional<NodeId> node{};
  std::optional<GroupType> type{};  // empty: group_init never seen
  EventRef first_seen{};
  std::vector<CallbackIndex> callbacks{};  // registered to it, in order
};

// One `thread_sched`.
struct ReadBack {
  EventRef at{};
  std::optional<SchedMoment> moment{};
  std::uint32_t n = 0;
  std::int32_t policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
  std::vector<std::uint32_t> cpus{};
  std::int32_t error = 0;
  std::uint64_t starts_before = 0;  // callback starts seen on the thread before it
};

// A hole in contiguous numbers: `missing` numbers are absent between two events.
struct SequenceGap {
  std::uint64_t expected = 0;
  std::uint64_t seen = 0;
  EventRef before{};  // last event before the hole (or the announcement that promised `expected`)
  EventRef after{};
};

// Numbers of one subject (`seq` of a callback or publisher, `n` of a thread).
struct SequenceFacts {
  std::uint64_t count = 0;  // numbers seen
  std::optional<std::uint64_t> first{};
  std::optional<std::uint64_t> last{};  // largest
  EventRef first_at{};
  EventRef last_at{};
  std::uint64_t missing = 0;
  std::optional<SequenceGap> first_gap{};
  std::uint64_t repeated = 0;  // a number not above the last, seen again or out of order
};

// A callback as seen running on a thread.
struct CallbackOnThread {
  CallbackIndex callback{};
  ThreadIndex thread{};
  std::uint64_t starts = 0;
  std::uint64_t instances = 0;  // complete, in the window
  EventRef first_start{};
  std::uint64_t first_seq = 0;
  EventRef last_activity{};  // last start or end of it there
};

struct SwitchPriority {
  EventRef at{};
  std::int32_t prio = 0;
};

// One thread incarnation: (process, tid, creation).
struct ThreadFacts {
  ProcessIndex process{};
  std::int64_t tid = 0;
  std::optional<EventRef> announced{};  // first thread_init; empty: never announced
  std::optional<ThreadRole> role{};
  std::optional<CallbackId> callback{};  // as announced; empty: none
  std::optional<GroupId> group{};
  std::string name{};
  std::optional<std::int64_t> start_ns{};
  std::optional<EventRef> fini{};
  std::uint32_t fini_read_backs = 0;
  std::optional<EventRef> kernel_exit{};  // sched_process_exit
  std::optional<EventRef> first_seen{};   // events that this thread itself emitted
  std::optional<EventRef> last_seen{};
  std::vector<CallbackOnThread> ran{};  // by first start

  SequenceFacts read_backs{};         // their `n`
  std::optional<ReadBack> initial{};  // first of moment initial
  std::vector<ReadBack> applied{};  // all of moment applied, capped at 1024 keeping first and last
  std::optional<ReadBack> first_audit{};
  std::optional<ReadBack> last_read_back{};
  std::optional<std::int64_t> audits{};  // how many

  // S3: first later audit or switch priority that differs from the last `applied` before it
  // (or from the first audit, where the process was announced).
  std::optional<std::pair<ReadBack, ReadBack>> audit_mismatch{};
  std::optional<std::pair<ReadBack, SwitchPriority>> priority_mismatch{};
  std::uint64_t switches_checked = 0;  // sched_switch priorities compared
  std::uint64_t audits_checked = 0;

  // S4: first run on a CPU outside the mask last read back before.
  std::optional<std::pair<ReadBack, EventRef>> cpu_violation{};
  std::uint64_t cpus_checked = 0;         // user events and switch-ins compared
  std::uint64_t switch_cpus_checked = 0;  // of them, switch-ins

  // E3: an instance that contained the start of another (and did end).
  struct Nesting {
    CallbackIndex outer{};
    EventRef outer_start{};
    std::optional<EventRef> outer_end{};  // empty: it never ended
    CallbackIndex inner{};
    EventRef inner_start{};
  };
  std::optional<Nesting> nesting{};           // outer ended: proven
  std::optional<Nesting> nesting_unproven{};  // outer never ended: an end may be lost

  // M6: on-CPU time outside instances, from the first wait to the end; needs kernel events.
  std::optional<Timestamp> first_wait{};
  std::optional<std::int64_t> foreign_ns{};
  std::optional<std::int64_t> foreign_span_ns{};

  std::optional<std::int64_t> busy_ns{};  // on-CPU time
  bool is_fork_child_of_real_time = false;
};

// A child created by a real-time thread (S5), seen through fork events.
struct ForkFacts {
  EventRef at{};
  HostIndex host{};
  std::int64_t parent_tid = 0;
  std::int64_t child_tid = 0;
  std::int32_t parent_prio = 0;                 // last seen in a switch
  std::optional<SwitchPriority> child_first{};  // first switch-in of the child
  std::optional<ThreadIndex> child{};           // when announced later
};

template <typename Value>
struct Extreme {
  Value value{};
  std::uint64_t seq = 0;
  EventRef start{};
  std::optional<EventRef> end{};
  std::optional<Timestamp> release{};
};

struct CallbackTotals {
  EventRef at{};
  std::uint64_t started = 0;
  std::uint64_t ended = 0;
  std::uint64_t released = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t lost = 0;
};

// An instance without an end when the trace (or its process) ended.
struct OpenInstance {
  EventRef start{};
  std::uint64_t seq = 0;
  std::optional<Timestamp> release{};
  bool release_exact = false;
  std::uint32_t missed = 0;
  ThreadIndex thread{};
};

// A callback went on on another thread.
struct Move {
  ThreadIndex from{};
  ThreadIndex to{};
  EventRef last_on_from{};
  EventRef first_on_to{};
  bool registered_again = false;  // a new callback_init (not an announcement) lies between
};

struct CallbackFacts {
  ProcessIndex process{};
  CallbackId id{};
  std::optional<EventRef> registered{};  // first callback_init; empty: never seen
  std::uint32_t inits = 0;
  std::optional<EventRef> last_init{};      // last callback_init that was not a mere announcement
  std::uint64_t announcements_at_init = 0;  // of its process, at the last callback_init
  std::uint64_t first_next_seq = 0;         // of the first callback_init seen
  std::string logical_id{};                 // "?<id>" when never registered
  std::string node{};
  NodeId node_id{};
  std::optional<CallbackKind> kind{};
  std::optional<GroupId> group{};
  std::string source{};
  std::string symbol{};
  std::uint64_t period_ns = 0;
  std::uint32_t queue_depth = 0;
  std::uint64_t deadline_ns = 0;
  std::optional<CallbackTotals> fini{};

  SequenceFacts starts{};
  std::uint64_t ends = 0;
  std::uint64_t releases = 0;
  std::optional<EventRef> max_end_at{};  // of the largest seq ended
  std::optional<std::uint64_t> max_end_seq{};
  std::uint64_t ends_without_start = 0;  // seq not below the first start seen
  std::uint64_t ends_before_first = 0;   // of instances cut by the window's begin
  std::optional<std::pair<std::uint64_t, EventRef>> first_end_without_start{};
  std::uint64_t second_ends = 0;
  struct SecondEnd {
    std::uint64_t seq = 0;
    EventRef first{};
    EventRef second{};
  };
  std::optional<SecondEnd> first_second_end{};

  std::vector<CallbackOnThread> ran_on{};  // by first start
  std::vector<Move> moves{};               // capped at 1024
  std::uint64_t starts_without_tid = 0;

  struct Overlap {
    std::uint64_t first_seq = 0;
    EventRef first_start{};
    std::optional<EventRef> first_end{};
    std::uint64_t second_seq = 0;
    EventRef second_start{};
  };
  std::optional<Overlap> overlap{};           // the first one did end: proven
  std::optional<Overlap> overlap_unproven{};  // it never ended

  // Complete instances in the window, by what their release is known from.
  std::uint64_t instances = 0;
  std::uint64_t exact_instances = 0;
  std::uint64_t cut_instances = 0;
  std::vector<OpenInstance> open{};  // capped at 64
  std::uint64_t open_count = 0;
  std::array<std::uint64_t, 4> by_release_source{};  // indexed by ReleaseSource exact..start

  Statistics response_time{};
  Statistics response_time_lower{};
  Statistics response_time_upper{};
  Statistics start_latency{};
  Statistics duration{};
  Statistics inter_arrival{};
  Statistics execution_time{};
  Statistics preempted{};
  Statistics blocked{};
  Statistics wake_delay{};
  Statistics wakeup_latency{};
  std::uint64_t identity_failures = 0;

  // Witnesses of the extremes, over complete instances in the window.
  std::optional<Extreme<Duration>> max_response{};        // exact ones
  std::optional<Extreme<Duration>> max_response_lower{};  // exact value or lower bound
  std::optional<Extreme<Duration>> max_response_upper{};  // exact value or upper bound
  std::uint64_t without_upper_bound = 0;                  // inexact, no upper bound
  std::optional<Extreme<Duration>> max_duration{};
  std::optional<Extreme<Duration>> max_execution{};
  std::optional<Extreme<Duration>> max_duration_without_execution{};  // CPU time unknown
  // Inter-arrival of consecutive seqs, both exact; seq and start are the later one's.
  std::optional<Extreme<Duration>> min_inter_arrival{};
  std::optional<Extreme<Duration>> max_inter_arrival{};
  // R1 directly: release of k+1 at or before the end of k.
  struct ReleaseBeforeEnd {
    std::uint64_t seq = 0;
    EventRef start{};
    EventRef end{};
    Timestamp next_release{};
    EventRef next_start{};
  };
  std::optional<ReleaseBeforeEnd> release_before_end{};

  std::uint64_t missed = 0;  // skipped periods, those before open instances included
  std::optional<Extreme<std::uint32_t>> first_missed{};
  std::uint64_t overwritten = 0;  // last running total of callback_release
  std::uint64_t lost = 0;         // last running total of sample_lost
  std::optional<EventRef> overwritten_at{};
  std::optional<EventRef> lost_at{};
};

struct PublisherFacts {
  ProcessIndex process{};
  PublisherId id{};
  std::optional<EventRef> registered{};
  std::uint64_t first_next_seq = 0;
  std::string topic{};
  std::uint64_t writer_gid = 0;
  std::optional<NodeId> node{};
  SequenceFacts published{};
  std::optional<std::pair<EventRef, std::uint64_t>> fini{};  // total published
  std::optional<std::int64_t> first_source_timestamp{};
};

// Chain instance as a witness.
struct ChainExtreme {
  Duration value{};
  EventRef first_start{};  // of the first callback's instance
  EventRef last_end{};
};

struct ChainFacts {
  std::string name{};
  bool specified = false;
  std::vector<std::string> hops{};
  std::vector<CallbackIndex> last_callbacks{};  // resolved hops of the last instance seen
  std::optional<ProcessIndex> process{};        // empty when it spans processes or never ran
  std::uint64_t instances = 0;
  std::uint64_t incomplete = 0;  // a hop's publish is unseen without excuse
  std::optional<EventRef> first_incomplete{};
  std::uint64_t inexact = 0;  // a release on it is not exact
  Statistics path_latency{};
  Statistics reaction_time{};
  Statistics data_age{};
  std::vector<Statistics> processing{};     // one per hop
  std::vector<Statistics> communication{};  // one fewer
  std::optional<ChainExtreme> max_path_latency{};
  std::optional<ChainExtreme> max_reaction_time{};
  std::optional<ChainExtreme> max_data_age{};
};

// Which event classes and contexts the trace has at all (T5 and "event class absent").
struct EventCounts {
  std::uint64_t total = 0;
  std::map<std::string, std::uint64_t, std::less<>> by_name{};  // of the vocabularies we know
  std::uint64_t cie = 0;
  std::uint64_t cie_without_pid = 0;
  std::uint64_t cie_without_tid = 0;
};

struct TimeRegressionFacts {
  std::uint64_t count = 0;
  std::optional<EventRef> first{};
  Timestamp first_previous{};
};

struct Model {
  std::vector<std::string> paths{};
  std::vector<HostFacts> hosts{};
  std::vector<StreamFacts> streams{};
  std::map<std::uint32_t, ChannelFacts> channels{};
  std::vector<Loss> losses{};  // capped at 100 000; see losses_dropped
  std::uint64_t losses_dropped = 0;
  // Deques, because trackers hold references and observers hold views of names.
  std::deque<ProcessFacts> processes{};
  std::deque<ThreadFacts> threads{};
  std::deque<CallbackFacts> callbacks{};
  std::vector<NodeFacts> nodes{};
  std::deque<GroupFacts> groups{};
  std::deque<PublisherFacts> publishers{};
  std::vector<ForkFacts> forks{};
  std::vector<ChainFacts> chains{};
  EventCounts events{};
  TimeRegressionFacts time_regressions{};
  bool clocks_unrelated = false;  // streams of one host disagree about the boot
  // What all user channels cover (all channels, if there is no user channel); their hull where they
  // have nothing in common.
  std::optional<Timestamp> begin{};
  std::optional<Timestamp> end{};
};

}  // namespace cie::analysis
