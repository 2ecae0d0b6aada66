// Facts about processes, their groups and threads, and which callbacks ran on which thread.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/rare.hpp>
#include <cie/tracepoints/schema.hpp>

#include "recording_facts.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::analysis {

struct RunTotals {
  EventRef at{};
  std::uint32_t callbacks = 0;
  std::uint32_t threads = 0;
  std::uint32_t groups = 0;
  std::uint32_t publishers = 0;
  std::int32_t status = 0;
};

// A callback whose runs no event of ROS 2's tracers shows, as a client's for its responses.
struct HiddenCallback {
  EventRef made{};
  std::string what{};  // "the client of /car/enable"
  std::string node{};
  bool is_client = false;          // else a service
  bool is_action = false;          // its part in an action
  bool is_pooled = false;          // its group's executor has several threads, as is told
  std::optional<GroupId> group{};  // empty: not told
  std::set<ThreadIndex> ran_on{};  // took a client's responses, where the tracer tells
};

// What showed that another process has the pid of one.
enum class PidSharing : std::uint8_t {
  begun,       // its run_begin, while this one had not ended: it is of another pid namespace, or a
               // child of fork() without LTTng's library for it
  other_init,  // its callback_init: its run_begin was lost
  perhaps,     // events that follow the run_end and a loss, which may have taken a run_begin
  announced_late,  // a run_begin of a process that had begun before the last instances of this one
  told_again,  // what one process tells once or in order, after a loss that may have taken a run_begin
  crossed,     // instances on one thread that overlap and do not nest
  beside_own,  // since an rcl_init, ROS 2's events tell of runs that none of its own ones tells
};

// The spec that a run_begin names first. Of several executors it is the first one's, or that of the
// last one that reloaded.
struct LoadedSpec {
  Timestamp since{};
  std::string sha256{};  // empty: none
};

// One process incarnation: (host, pid, process start).
struct ProcessFacts {
  HostIndex host{};
  std::int64_t pid = 0;                 // as it knows itself
  std::int64_t told_pid = 0;            // as events have it: pid_in_namespace()
  std::optional<EventRef> run_begin{};  // first one seen
  std::optional<RunMoment> first_moment{};
  std::string executor{};
  std::string boot_id{};
  std::vector<LoadedSpec> specs{};  // in order: of its first run_begin, and of each reload
  std::string tool_version{};
  std::optional<std::int64_t> start_ns{};
  std::uint64_t pid_ns = 0;
  // Where that is not known: whether the kernel's switches have its threads where they speak, by the
  // tids that they have in its events. Empty: neither was seen.
  std::optional<bool> speaks_where_switched{};
  bool is_pid_own = true;  // false: run_begin names another process than its context does
  // In a time namespace: by what its CLOCK_MONOTONIC is ahead of the machine's.
  std::int64_t monotonic_offset_ns = 0;
  // Another process has the same pid, so that whose events are whose is unknown, and what showed it.
  std::optional<EventRef> shares_pid_since{};
  PidSharing pid_sharing{};
  std::optional<EventRef> told_again{};  // first event that no one process tells twice, told twice
  std::uint32_t contract_version = 0;
  std::uint32_t online_cpus = 0;
  std::optional<RunTotals> run_end{};    // last one seen
  Timestamp last_begin{};                // last run_begin seen
  std::int64_t last_begin_told = 0;      // its monotonic_ns
  std::optional<EventRef> executed{};    // another program in its place, as the kernel tells
  std::optional<EventRef> first_seen{};  // any event of this pid
  std::optional<EventRef> last_seen{};
  std::uint64_t announcements = 0;               // run_begin of moment announce
  std::optional<std::int64_t> announcing_tid{};  // that told the last of them, and what followed
  bool is_announcing_callbacks = false;          // it told none of what follows them there since
  // Of its own, or such as follow from ROS 2's: else it is no process of the report.
  bool has_cie_events = false;
  std::string name{};                   // command name where known
  std::vector<std::uint32_t> traces{};  // of its first event and of each run_begin
  // Of a process that only ROS 2's tracers tell of.
  bool is_from_ros2 = false;
  std::optional<EventRef> ros2_begin{};  // rcl_init, before which nothing was
  std::string tracetools{};              // version; empty: not told
  std::vector<HiddenCallback> hidden{};
  bool tells_responses = false;  // who takes clients'
  // By id: callbacks of its that ROS 2's events tell of and none of its own, and the first instance that
  // was seen.
  std::map<std::string, std::optional<EventRef>> beside_own{};
};

// It emits none of cie's own events of its run.
inline bool is_ros2_only(const ProcessFacts& process) noexcept {
  return process.is_from_ros2 && !process.run_begin;
}

// Its first event was recorded.
inline bool has_begun_here(const ProcessFacts& process) noexcept {
  return process.run_begin || (process.is_from_ros2 && process.ros2_begin);
}

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
  bool is_accounted = true;                // its process counts it among its own
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
  std::optional<std::uint64_t> slice_ns{};  // empty: the recording does not tell; 0: has none
  std::optional<std::uint32_t> util_min{};  // likewise
  std::optional<std::uint32_t> util_max{};  // 0: the kernel has no utilization clamps
  std::uint32_t change = 0;                 // of the parameters; 0: the first configuration
  std::uint64_t starts_before = 0;          // callback starts seen on the thread before it
};

// Parameters that a thread ran with, from one read-back that shows them to the next one that shows others
// or that they change.
struct InForce {
  ReadBack since{};
  std::optional<Timestamp> until{};  // empty: up to the last read-back and from there on
  std::uint64_t starts = 0;  // of callbacks on the thread meanwhile, certain ones alone if any is
  struct Start {
    CallbackIndex callback{};
    std::uint64_t seq = 0;
    EventRef at{};
    bool is_certain = false;  // no other read-back can have come between it and the ones around it
  };
  // One of those starts, a certain one if any was. Empty: none was seen, or none is known to be one.
  std::optional<Start> start{};
};

// Events of two CPUs have no order within a nanosecond; read-backs of a thread have their numbers.
inline bool is_older(const ReadBack& a, const ReadBack& b) {
  return a.at.time == b.at.time ? a.n < b.n : a.at.time < b.at.time;
}
// Whether two read-backs name the same policy, priority or nice, deadline triple and CPUs. The nice value of
// SCHED_IDLE means nothing.
bool is_same_parameters(const ReadBack& a, const ReadBack& b);
// The kernel's priority (99 - rt, 120 + nice, -1) that a read-back's policy gives.
std::int32_t kernel_priority(const ReadBack& read_back);
// A priority that the kernel shows of a thread that was read back so: that of the read-back where the two
// differ by nothing but the nice value of SCHED_IDLE, of which sched_getattr() and sched_switch tell two.
std::int32_t without_idle_nice(const ReadBack& read_back, std::int32_t prio);
// The kernel's priority of SCHED_FIFO, SCHED_RR or SCHED_DEADLINE.
constexpr bool is_real_time_priority(std::int32_t kernel_priority) noexcept {
  return kernel_priority < 100;
}

// A hole in contiguous numbers: `missing` numbers are absent between two events.
struct SequenceGap {
  std::uint64_t expected = 0;
  std::uint64_t seen = 0;
  EventRef before{};  // last event before the hole (or the announcement that promised `expected`)
  EventRef after{};
};

// Numbers of one subject (`seq` of a callback or publisher, `n` of a thread).
struct SequenceFacts {
  std::uint64_t count = 0;              // numbers seen
  std::optional<std::uint64_t> last{};  // largest
  EventRef last_at{};
  bool is_restarted = false;  // a new series began, of which no number was seen yet
  std::optional<std::uint64_t> first{};
  EventRef first_at{};
  std::uint64_t missing = 0;
  Rare<SequenceGap> first_gap{};
  std::uint64_t repeated = 0;  // a number not above the last, seen again or out of order
};

// A CPU that a thread was seen on: the first time and the last.
struct UsedCpu {
  EventRef first{};
  EventRef last{};
};
// It was seen there once more.
void note_cpu(std::vector<UsedCpu>& cpus, const EventRef& where);

// A start on a thread that was announced for another callback before.
struct BesideOther {
  std::uint64_t seq = 0;
  EventRef start{};
  Timestamp
      since{};  // when the other callback was seen there last, or the thread was announced for it
};

// A callback as seen running on a thread. What every instance touches takes one cache line.
struct alignas(64) CallbackOnThread {
  CallbackIndex callback{};
  ThreadIndex thread{};
  std::uint64_t starts = 0;
  std::uint64_t instances = 0;  // complete, in the window
  bool is_certain =
      false;  // some run there was the callback's own: see CallbackStart::may_be_another
  bool is_of_several = false;  // see note_addresses_in_turn()
  EventRef last_activity{};    // last start or end of it there
  EventRef first_start{};      // without starts: the end that alone tells of it
  std::uint64_t first_seq = 0;
  // Where that end's instance had started, on another thread. Empty: that was not seen.
  Rare<EventRef> first_begun_elsewhere{};
  // Of its starts and ends, where a spec asks for CPUs; where the last one was, it was seen last at
  // `last_activity`.
  std::vector<UsedCpu> cpus{};
  Rare<BesideOther> first_beside_other{};
};

struct SwitchPriority {
  EventRef at{};
  std::int32_t prio = 0;
};

// A stretch of time through which the kernel scheduled a thread with one priority (priority
// inheritance aside).
struct ScheduledAs {
  SwitchPriority first{};           // where it was seen first
  EventRef last{};                  // and last
  std::uint64_t starts_before = 0;  // callback starts seen on the thread before it
  // Where the thread was switched in, by CPU.
  std::vector<UsedCpu> cpus{};
};

inline constexpr Duration kTickOfStart{10'000'000};  // USER_HZ is 100
// It had begun by then: it was seen, or says when it was started, in ticks of the kernel's clock.
inline Timestamp latest_begin(const ProcessFacts& process) noexcept {
  const auto seen = process.first_seen.value_or(EventRef{}).time;
  if (!process.start_ns) return seen;
  return std::min(seen, Timestamp{*process.start_ns} + kTickOfStart);
}

// The kernel's events name threads by their tids in its first pid namespace. In another one, as of a
// container, they are others, and nothing relates the two. Nor does where the process has another clock.
inline bool has_tids_of_kernel(const ProcessFacts& process) noexcept {
  if (process.monotonic_offset_ns != 0) return false;
  constexpr std::uint64_t kFirstOfOthers = 0xf0000000;  // PROC_DYNAMIC_FIRST of Linux
  if (process.pid_ns == 0) return process.speaks_where_switched.value_or(true);
  return process.pid_ns < kFirstOfOthers;
}
// No doubt is left of what has_tids_of_kernel() says.
inline bool is_pid_ns_known(const ProcessFacts& process) noexcept {
  return process.pid_ns != 0 || process.speaks_where_switched == true;
}

inline constexpr std::size_t kMostFormer = 64;

// For whom a thread was announced before it was announced for another callback or group.
struct FormerAnnouncement {
  EventRef at{};    // its first thread_init
  EventRef next{};  // that of the other one
  std::optional<EventRef> fini{};
  std::optional<CallbackId> callback{};
  std::optional<GroupId> group{};
  std::uint32_t last_change = 0;  // as of ThreadFacts
};

// One thread incarnation: (process, tid, creation). What every instance on it reads comes first and
// together, so that it takes few cache lines.
struct alignas(64) ThreadFacts {
  std::optional<EventRef> announced{};  // first thread_init; empty: never announced
  std::optional<EventRef> fini{};
  ProcessIndex process{};
  std::optional<ThreadRole> role{};
  bool is_known_to_kernel = true;  // its events name the thread by this tid
  std::int64_t tid = 0;
  std::optional<CallbackId> callback{};      // as announced last; empty: none
  std::vector<FormerAnnouncement> former{};  // capped at kMostFormer, keeping the first
  std::optional<GroupId> group{};
  std::uint64_t announcements_at_init = 0;  // of its process, at the first thread_init
  std::vector<CallbackOnThread*> ran{};     // of the model's pairs, by first start
  std::string name{};
  std::optional<std::int64_t> start_ns{};
  std::uint32_t fini_read_backs = 0;
  // Of a thread that is known only by a callback that started on its tid after this `thread_fini`
  // of the tid's last thread, and before any other `thread_init`.
  Rare<EventRef> former_fini{};
  std::optional<EventRef> kernel_exit{};  // sched_process_exit, or the switch that it died in
  std::string_view kernel_exit_event{};   // which of them
  bool is_tid_given_anew = false;         // a thread with its tid was created: it is gone
  std::optional<EventRef> switched_in{};  // the last time, if nothing told that it was gone
  std::optional<EventRef> first_seen{};   // events that this thread itself emitted
  std::optional<EventRef> last_seen{};

  SequenceFacts read_backs{};       // their `n`
  Rare<ReadBack> initial{};         // of moment initial, if nothing was read back before
  std::vector<ReadBack> applied{};  // all of moment applied, capped at 1024 keeping first and last
  std::uint32_t spins = 0;          // how often it was announced, repetitions apart
  std::optional<Timestamp> announced_again{};  // after an end: for another spin on it
  // S1: what was in force since the first read-back that differs from the first configuration. That it
  // is cut: there was more.
  std::vector<InForce> in_force{};
  bool is_in_force_cut = false;
  Rare<ReadBack> first_audit{};
  Rare<ReadBack> last_read_back{};
  std::uint32_t last_change = 0;         // of its parameters, that any read-back tells of
  std::optional<std::int64_t> audits{};  // how many

  // S3: first later audit or switch priority that differs from the last `applied` before it
  // (or from the first audit, where the process was announced). A raised priority may be an
  // inherited one whose sched_pi_setprio is lost; a lowered one is never inherited.
  Rare<std::pair<ReadBack, ReadBack>> audit_mismatch{};
  // The same of slices and clamps that are the kernel's own, as far as read-backs tell: of each the
  // first.
  std::vector<std::pair<ReadBack, ReadBack>> slice_or_clamp_mismatches{};
  Rare<std::pair<ReadBack, SwitchPriority>> raised_priority{};
  Rare<std::pair<ReadBack, SwitchPriority>> lowered_priority{};
  // A raised priority that tells nothing, because it may be inherited, and no switch since then that does.
  Rare<SwitchPriority> perhaps_inherited{};
  std::uint64_t switches_checked = 0;  // sched_switch priorities compared
  std::uint64_t audits_checked =
      0;  // compared with what was applied, or with the first audit that stands for it

  // S1 and S2, of threads without any read-back: what sched_switch tells. Capped at 1024.
  std::vector<ScheduledAs> scheduled{};

  // S4: first run on a CPU outside the mask last read back before.
  Rare<std::pair<ReadBack, EventRef>> cpu_violation{};
  std::uint64_t cpus_checked = 0;         // user events and switch-ins compared
  std::uint64_t switch_cpus_checked = 0;  // of them, switch-ins

  // E3: an instance that contained the start of another (and did end).
  struct Nesting {
    CallbackIndex outer{};
    EventRef outer_start{};
    std::optional<EventRef> outer_end{};  // empty: it never ended; of another thread: unproven
    CallbackIndex inner{};
    EventRef inner_start{};
  };
  Rare<Nesting> nesting{};  // outer ended: proven
  // Outer never ended: an end may be lost; or it ended on another thread, and may have left this one
  // before inner started.
  Rare<Nesting> nesting_unproven{};

  // The first of ProcessFacts::beside_own that ran there: its id and that instance.
  Rare<std::pair<std::string, EventRef>> beside_own{};

  // M6: on-CPU time outside instances, from the first wait to the end; needs kernel events.
  struct ForeignWork {
    Duration seen{};
    Duration span{};
    bool is_whole = false;  // else there may be more of it
  };
  std::optional<Timestamp> first_wait{};
  Rare<ForeignWork> foreign{};

  std::optional<std::int64_t> busy_ns{};  // on-CPU time; empty: not known without a hole
  // First of its own events on a CPU of which the kernel recorded nothing at that time.
  Rare<EventRef> ran_unrecorded{};
};

// The slice or clamp of a read-back if somebody asked for it, which shows when it is not the one
// with which the thread began. 0: the policy or the kernel has none.
template <typename Integer>
std::optional<Integer> asked_for(const ThreadFacts& thread, const ReadBack& read_back,
                                 std::optional<Integer> ReadBack::*field) {
  const auto& value = read_back.*field;
  if (!thread.initial || !value || *value == 0) return std::nullopt;
  const auto& began = *thread.initial.*field;
  return began && *began != *value ? value : std::nullopt;
}

// The kernel's events of its tid tell of another thread.
void forget_kernel_record(ThreadFacts& thread);
// What was applied is in force: what it was given before another spin on it may have been taken back
// meanwhile.
inline bool is_in_force(const ThreadFacts& thread, const ReadBack& applied) {
  return !thread.announced_again || applied.at.time >= *thread.announced_again;
}
inline bool is_given_parameters(const ThreadFacts& thread) {
  return !thread.applied.empty() && is_in_force(thread, thread.applied.back());
}
// One more of moment applied.
void note_applied(ThreadFacts& thread, const ReadBack& read_back);
// Its tid may be another one's by now.
inline bool is_gone(const ThreadFacts& thread) noexcept {
  return thread.kernel_exit.has_value() || thread.is_tid_given_anew;
}
// When it began, as far as it is known.
std::optional<Timestamp> birth_of(const ThreadFacts& thread);

// A child created by a real-time thread (S5), seen through fork events.
struct ForkFacts {
  EventRef at{};
  HostIndex host{};
  std::int64_t parent_tid = 0;
  std::int64_t child_tid = 0;                   // 0: one of very many, which was no violation
  std::int32_t parent_prio = 0;                 // last seen in a switch
  std::int32_t parent_own_prio = 0;             // when nobody waits for it, as far as known
  bool is_parent_boosted = false;               // it inherited the first of them, as was told
  std::optional<ThreadIndex> parent{};          // if it was announced, or spoke
  std::optional<SwitchPriority> child_first{};  // first switch-in of the child
  std::optional<ThreadIndex> child{};           // when announced later
};

}  // namespace cie::analysis
