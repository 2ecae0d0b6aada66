// Compares what threads do with what their parameters allow, event by event: audits, priorities and
// CPUs of switches, CPUs of user events, children of real-time threads, work outside callbacks.
#pragma once

#include <cie/analysis/event.hpp>

#include "base/prefetch.hpp"
#include "flat_map.hpp"
#include "instance_builder.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"
#include "thread_timeline.hpp"

#include <map>
#include <optional>
#include <vector>

namespace cie::analysis {

class EnforcementTracker {
 public:
  EnforcementTracker(Model& model, Registry& registry, const RecordingTracker& recording,
                     ThreadTimeline& timeline, InstanceBuilder& instances)
      : model_(model),
        registry_(registry),
        recording_(recording),
        timeline_(timeline),
        instances_(instances) {}

  void on_read_back(const EventHead& head, ThreadIndex thread, const ThreadSched& event);
  // An audit after the window: where it agrees, nothing changed in the window that lasted.
  void on_later_audit(ThreadIndex thread, const ReadBack& audit);
  // The thread will emit an event soon.
  void prefetch(ThreadIndex thread) const noexcept { prefetch_head(places_.find(thread)); }
  // Whether on_user_event() does anything.
  bool heeds_events_of(ThreadIndex thread) const noexcept {
    const auto* place = places_.find(thread);
    return has_switches_ || (place != nullptr && place->is_bound());
  }
  void on_user_event(const EventHead& head, ThreadIndex thread) {
    auto* place = places_.find(thread);
    if (place == nullptr || !place->is_bound()) {
      if (has_switches_) adopt_unread(head, thread);
      return;
    }
    if (!head.cpu || !is_judging_) return;
    if (*head.cpu == place->cpu) {
      ++place->seen_again;
    } else {
      check_cpu(head, thread, false);
    }
  }
  // After the timeline has seen the switch.
  void on_switch(const EventHead& head, HostIndex host, const SchedSwitch& event);
  void on_fork(const EventHead& head, HostIndex host, const SchedProcessFork& event);
  void on_pi_setprio(const EventHead& head, HostIndex host, const SchedPiSetprio& event);
  // A thread_init that begins a new incarnation: what the tid ran before is not its own.
  void on_thread_began(HostIndex host, ThreadIndex thread);
  // Nobody reads it back any more, whatever it runs for others.
  void on_thread_fini(const EventHead& head, ThreadIndex thread);
  // Nothing is judged before the one and after the other.
  void await_window() noexcept { is_judging_ = false; }
  // It may begin now: of a snapshot that turns out later, and what ran since then is in it.
  void note_possible_begin(Timestamp time);
  void begin_window(Timestamp begin);
  void end_window(Timestamp end);
  // The stream's trace, in user space, lacks events from here on: what threads do may be in callbacks.
  void on_record_end(StreamIndex stream, Timestamp time);
  // Totals what has been seen until now; more may follow.
  void look();
  void finish();

 private:
  // Read-backs of one nanosecond, in order, and what was known before the first of them.
  struct Comparison {
    std::vector<ReadBack> read_backs;
    Rare<ReadBack> applied_before;
    bool was_changing = false;
    std::uint64_t audits_checked = 0;
    bool had_mismatch = false;
    std::size_t slice_or_clamp_mismatches = 0;
  };
  // What a thread had done at a time.
  struct Reading {
    ThreadTimeline::Mark mark;
    std::optional<Duration> inside;  // on-CPU time in instances
  };
  // On-CPU time of a thread outside instances since its first wait, from wait to wait as far as the kernel's
  // record is whole.
  struct ForeignWork {
    Timestamp begin;
    Reading counted_to;
    Duration seen;
    bool is_whole = true;
  };
  // A priority that a thread inherits through a mutex, as sched_pi_setprio tells.
  struct Inheritance {
    bool is_boosted = false;        // runs at such a priority
    std::int32_t prio = 0;          // that of who waits for it, as was told last
    std::optional<Timestamp> told;  // by the last of these events
  };
  // Where a thread may run, and does. Each of its events looks at it: it lies close to that of others.
  struct Place {
    static constexpr auto kAnywhere = std::numeric_limits<std::int64_t>::min();
    static constexpr auto kNotSeen = kAnywhere + 1;
    // The allowed CPU on which it was seen last. kAnywhere: it was not read back with the CPUs it may
    // use. kNotSeen: on none of them since that was, or its parameters change.
    std::int64_t cpu = kAnywhere;
    std::uint64_t seen_again = 0;  // times it was seen there since, not yet in its facts

    bool is_bound() const noexcept { return cpu != kAnywhere; }
  };
  struct OfThread {
    bool is_changing = false;  // an audit told that its parameters change; no `applied` since
    Rare<Comparison> compared;
    // It ran outside the mask that it inherited, once for each CPU: what is applied first may have
    // sent it there before it was read back.
    std::vector<EventRef> outside_initial;
    Rare<ReadBack> initial;   // of that mask
    Inheritance inheritance;  // as far as it is above what it must run as
    // Its parameters were applied after the last sched_pi_setprio, which does not tell of waiters that
    // are no more urgent than it was then: to the new parameters they may be. Or that told of no change,
    // which LTTng's says where the last waiter has gone.
    bool may_be_boosted = false;
    // It lived before the kernel's record began, and since then neither ran at its own priority nor had
    // a sched_pi_setprio.
    std::optional<bool> may_be_boosted_before;
    // Nothing has shown it at its own priority since the switch that its facts tell of.
    bool is_still_raised = false;
    Rare<ForeignWork> foreign;
    // When the trace that told of it first ended, or a later one that told of it since.
    Rare<Reading> record_end;
    Duration busy_before;            // of earlier incarnations of its tid
    bool is_former_unended = false;  // the last one on its tid, of which the end was not seen
    bool is_gone = false;            // left its CPU dead: what has its tid now is not it
  };
  struct OfTid {
    std::int32_t prio = 120;
    std::optional<EventRef> scheduled;  // its last switch
    // What follows is told by the kernel's events alone, of threads, too, of which nothing else is known.
    Inheritance inheritance;
    std::int32_t unboosted = 0;         // the priority before that
    std::optional<SwitchPriority> own;  // in its last switch with a priority that was not inherited
    // The last event took that priority back to this, which so is its own if it runs with that next.
    std::optional<std::int32_t> taken_back;
    // The incarnation that holds the tid, and the tid's on-CPU time when it last left a CPU for
    // good.
    std::optional<ThreadIndex> thread;
    bool has_left = false;  // since that one began
    Duration busy_at_exit;
    Duration busy_before_window;  // its on-CPU time when the window began
    // Of the incarnation that holds the tid, if a real-time thread created it: index into model.forks.
    std::optional<std::uint32_t> fork;
    bool is_new = false;  // its first switch-in is awaited
  };

  // What threads had done when the window began.
  struct BeginningOfThread {
    ThreadTimeline::Mark mark;
    bool is_over = false;  // it had ended
  };
  struct BusyTid {
    HostIndex host{};
    std::int64_t tid = 0;
    Duration busy;
  };
  struct Beginning {
    std::vector<BeginningOfThread> threads;  // by index
    std::vector<BusyTid> tids;               // of threads, too, of which nothing is known yet
  };
  Beginning beginning_at(Timestamp time);
  // Of the thread's on-CPU time that of its tid is `total`.
  static Duration busy_of(const OfThread& thread, const OfTid& tid, Duration total) {
    return total - std::max(thread.busy_before, tid.busy_before_window);
  }

  // What the thread must run as: its last `applied`, or, on an attached process, its first audit.
  const ReadBack* reference(const ThreadFacts& thread) const;
  // Null: the process was not attached, or has none yet.
  const ReadBack* first_audit_of_attached(const ThreadFacts& thread) const;
  // A switch tells the priority of a thread; `number`: its tid.
  void on_priority(const EventHead& head, HostIndex host, std::int64_t number, std::int32_t prio,
                   OfTid& tid);
  // With what it must run as. Outside the window it shows what is inherited, and is not judged.
  void check_priority(const EventRef& where, HostIndex host, ThreadIndex index, std::int32_t prio);
  // An audit with what was applied before.
  void compare(ThreadFacts& thread, OfThread& state, const ReadBack& expected,
               const ReadBack& audit);
  void compare_in_order(ThreadFacts& thread, OfThread& state, const ReadBack& read_back);
  // The comparisons of the last nanosecond.
  static void undo(ThreadFacts& thread, OfThread& state);
  void check_cpu(const EventHead& head, ThreadIndex index, bool is_switch);
  void note_outside_initial(OfThread& state, const EventRef& where);
  // What the thread's first parameters say of where it ran before.
  void judge_outside_initial(ThreadFacts& thread, OfThread& state, bool is_applied);
  void end_beginnings();
  // A switch at this priority tells nothing of the thread's own: it was inherited then.
  static bool is_inherited(Timestamp time, std::int32_t prio, std::int32_t own,
                           Inheritance& inheritance);
  // What the event tells of the raised priority that was seen before.
  static void explain_raised(const EventHead& head, const SchedPiSetprio& event,
                             const ReadBack& expected, ThreadFacts& thread, OfThread& state);
  // The thread may have inherited its priority before anything of the kernel was recorded.
  bool may_be_boosted_before(const ThreadFacts& thread, HostIndex host, OfThread& state) const;
  // From its first wait on its work outside callbacks counts.
  bool has_begun_work(const ThreadFacts& thread) const;
  // A thread that nobody read back is scheduled with this priority.
  void note_priority(const EventRef& where, ThreadFacts& thread, std::int32_t prio);
  // What it was scheduled with until now was inherited, if it runs at the priority that was taken back.
  static void take_back(ThreadFacts& thread, const OfTid& tid, std::int32_t prio);
  // It had the priority of its own that its tid was seen with last.
  void note_own(ThreadFacts& thread, const OfTid& tid);
  // A thread speaks for the first time: what it was scheduled as until now is its own.
  void adopt_priority(const EventHead& head, ThreadFacts& thread);
  // The same if it is a thread that nobody read back.
  void adopt_unread(const EventHead& head, ThreadIndex thread);
  // The kernel's record of the thread has no hole between the two.
  bool is_recorded(const ThreadFacts& thread, Timestamp begin, Timestamp end) const;
  // It spoke after the record of it had ended in one trace: another one tells of it, too.
  static bool is_told_since(const ThreadFacts& thread, const OfThread& state);
  Reading reading(ThreadIndex index, HostIndex host, Timestamp time);
  void begin_foreign_work(ThreadIndex index, const Reading& begin);
  void forget_foreign_work(ThreadIndex index);
  void count_foreign_work(HostIndex host, ForeignWork& work, const Reading& until) const;
  void total_foreign_work(ThreadIndex index, HostIndex host, const Reading& end);
  // Busy time and foreign work of the threads that have not ended, until the record of them did, or now.
  void total(std::optional<Timestamp> now);
  void total(ThreadIndex index, HostIndex host, std::optional<Timestamp> now);
  // Up to which a thread counts; `is_there`: it has its tid still. Empty: not known, or it is gone.
  std::optional<Reading> end_of(ThreadIndex index, HostIndex host, bool is_there,
                                std::optional<Timestamp> now);
  // What its children inherit, as far as that is known.
  std::int32_t own_priority(const std::optional<ThreadIndex>& thread, const OfTid* seen,
                            std::int32_t latest) const;
  // That by its last switch, or by what was read back since.
  std::optional<std::int32_t> latest_priority(const std::optional<ThreadIndex>& thread,
                                              const OfTid* seen) const;
  // The next thread with the tid has its own priority.
  static void forget_own(OfTid& tid);
  // Nothing more is kept of a child than that it was no violation, once there are too many.
  void forget_fork(OfTid& child);

  Model& model_;
  Registry& registry_;
  const RecordingTracker& recording_;
  ThreadTimeline& timeline_;
  InstanceBuilder& instances_;
  ByIndex<ThreadIndex, Place> places_;
  ByIndex<ThreadIndex, OfThread> threads_;
  ByIndex<HostIndex, DenseMap<std::int64_t, OfTid>> tids_;
  std::vector<std::uint32_t> free_forks_;  // indices into model.forks
  bool is_judging_ = true;
  bool has_switches_ = false;  // of any host: until then nothing was scheduled
  bool is_totalled_ = false;
  Timestamp judged_from_{};  // begin of the window
  std::map<Timestamp, Beginning> possible_begins_;
};

}  // namespace cie::analysis
