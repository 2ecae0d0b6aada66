// What the kernel's scheduler did with each thread: cumulative on-CPU, preempted, blocked and
// wake-delay time, so that any interval's parts are the difference of two marks.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>

#include "flat_map.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/optional_time.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace cie::analysis {

// The four parts of a duration (definitions: identity). Blocked and wake delay are known only
// together, when the wake-ups were recorded.
struct TimeParts {
  Duration execution;
  Duration preempted;
  Duration blocked;
  Duration wake_delay;
};

class ThreadTimeline {
 public:
  // A reading of a thread's cumulative parts at one of its own events, when it was on a CPU.
  struct Mark {
    TimeParts total;
    std::uint64_t breaks = 0;        // times its record was found broken before the mark
    std::uint64_t split_breaks = 0;  // the same for blocked / wake delay only
    // Taken where the thread was presumed to have been switched in (0: it was known), and the last
    // presumption that proved wrong before the mark: one of the breaks, between what lies before
    // and after the presumed switch-in.
    std::uint64_t presumption = 0;
    std::uint64_t failed_presumption = 0;
    std::uint64_t departures = 0;  // times it left a CPU before the mark
    Timestamp time;
  };
  struct Parts {
    Duration execution;
    Duration preempted;
    std::optional<Duration> blocked;
    std::optional<Duration> wake_delay;
    bool has_left = false;  // the CPU, if only to come back
    // They end where the thread was presumed to be switched in (0: it was known): part of what is
    // counted as waiting it may have run.
    std::uint64_t presumption = 0;
  };
  struct Wake {
    OptionalTime waking;    // W: sched_waking, or sched_wakeup where the host has none
    OptionalTime first_in;  // first switch-in after W
    // Not earlier than that: of a sched_wakeup, the sched_waking before it may be lost.
    OptionalTime since;
  };
  struct Hole {
    Timestamp begin;
    Timestamp end;
    std::int32_t cpu = 0;  // -1: any
  };

  // Returns the hole that a switch reveals: its prev_tid is not the CPU's last next_tid, or another
  // thread spoke there since.
  std::optional<Hole> on_switch(HostIndex host, std::int32_t cpu, Timestamp time,
                                const SchedSwitch& event, Observer* observer);
  // A switch behind the end of what counts: who leaves the CPU shows what it hid until then. Only
  // the CPU's first one tells.
  std::optional<Hole> on_switch_behind(HostIndex host, std::int32_t cpu, Timestamp time,
                                       const SchedSwitch& event);
  // Of CPUs where a thread spoke by `end` that no switch had brought, and no switch came since: from
  // the last one to where it spoke.
  std::vector<Hole> open_holes(HostIndex host, Timestamp end) const;
  void on_waking(HostIndex host, std::int64_t tid, Timestamp time);
  // False: on_waking told of it before.
  bool on_wakeup(HostIndex host, std::int64_t tid, Timestamp time);
  // What counts begins now: a thread that is presumed to run is presumed to have been switched in
  // now, so that nothing before it counts, whatever comes of the presumption.
  void presume_since(HostIndex host, std::int64_t tid, Timestamp time);
  // The thread that the last switch of this CPU brought; 0 is the idle one. Empty before any.
  std::optional<std::int64_t> running_on(HostIndex host, std::int32_t cpu);
  // What a user event shows of its thread's tid: the switches have that there, or somebody else.
  enum class Shown : std::uint8_t { nothing, there, elsewhere };
  // A user event proves that its thread runs on its CPU, whatever was seen before, and that whom the
  // switches have there has left unseen. But while it is not known that the kernel names the thread
  // so (`is_named_so`; in a container another thread has the number), one that contradicts the
  // switches proves nothing, and is shown.
  Shown on_user_event(HostIndex host, std::int64_t tid, std::optional<std::int32_t> cpu,
                      Timestamp time, bool is_named_so);
  // A switch has brought the thread to this CPU, and none has taken it away.
  bool is_there(HostIndex host, std::int64_t tid, std::optional<std::int32_t> cpu) const;
  // A preempted thread waits on another CPU from now on.
  void on_migrate(HostIndex host, std::int64_t tid, std::int32_t cpu, Timestamp time);
  void on_exit(HostIndex host, std::int64_t tid);
  void add_hole(HostIndex host, Hole hole);
  // What its switches tell from now on does not continue what they told.
  void begin_anew(HostIndex host, std::int32_t cpu);

  Mark mark(HostIndex host, std::int64_t tid, Timestamp time) const;
  // The same at its last switch: what it runs since then nothing has confirmed.
  Mark mark_at_last_switch(HostIndex host, std::int64_t tid) const;
  // The parts between two marks; empty if the thread's record broke between them.
  static std::optional<Parts> between(const Mark& from, const Mark& to);
  // Whether the switch-in has come that a mark of the thread presumed.
  bool is_proven(HostIndex host, std::int64_t tid, std::uint64_t presumption) const;
  // Whether an interval overlaps a hole or a loss of the kernel's record: of one CPU's, or of any.
  bool overlaps_hole(HostIndex host, Timestamp from, Timestamp to,
                     std::optional<std::int32_t> cpu = std::nullopt) const;
  // Of the host, on whatever CPU.
  std::optional<Timestamp> last_switch(HostIndex host) const;
  // Every CPU of the host has been heard of at or after `time`: no hole before it is left to find.
  bool is_confirmed(HostIndex host, Timestamp time);

  // The thread runs a callback from here to the matching end_watch(): it is noted who runs while it is
  // preempted.
  void begin_watch(HostIndex host, std::int64_t tid, Timestamp time);
  // Who did, since the first watch that has not ended; the times add up to the preempted part.
  std::vector<Preemptor> end_watch(HostIndex host, std::int64_t tid, Timestamp time);

  Wake last_wake(HostIndex host, std::int64_t tid) const;
  // Forgets wake-ups: a later instance or incarnation must not see them.
  void forget_wake(HostIndex host, std::int64_t tid);

 private:
  enum class State : std::uint8_t { unknown, running, preempted, blocked, waking };
  struct Thread {
    State state = State::unknown;
    // A user event of the time `since` moved it to running without a switch-in, which is presumed
    // to follow with the same time.
    bool is_presumed = false;
    bool is_switched_in = false;  // a switch brought it to `cpu`
    std::int32_t cpu = -1;
    Timestamp since;
    OptionalTime out;  // last switch-out
    TimeParts total;
    std::uint64_t breaks = 0;
    std::uint64_t split_breaks = 0;
    OptionalTime waking;
    OptionalTime wakeup;
    OptionalTime asleep;  // when it had left its CPU before `wakeup`
    OptionalTime first_in;
    std::uint64_t presumptions = 0;
    std::uint64_t failed_presumption = 0;
    std::uint64_t departures = 0;
    std::uint32_t watches = 0;
    std::int32_t waits_on = -1;  // watched and preempted: the CPU
    Timestamp charged;           // until then it is noted who ran there
    std::vector<Preemptor> preemptors;
    OptionalTime displaced;  // by another thread's user event on its CPU
  };
  static_assert(sizeof(Thread) <= 176, "a recording of the kernel has thousands");
  struct Cpu {
    std::int64_t tid = -1;  // last next_tid
    Timestamp time;         // last switch
    bool is_known = false;
    OptionalTime unknown_until;  // see SchedSlice
    OptionalTime spoken;  // when a thread spoke here that no switch had brought, first since `time`
    std::string name;     // of its thread, where somebody waits
    std::vector<std::int64_t> waiting;  // watched threads that were preempted here
  };
  struct Host {
    DenseMap<std::int64_t, Thread> threads;
    std::vector<Cpu> cpus;  // by first switch
    FlatMap<std::int32_t, std::size_t> cpu_places;
    std::size_t unconfirmed = 0;         // CPU that was not heard of when is_confirmed() last asked
    std::vector<Hole> holes;             // by end
    bool has_wakings = false;            // sched_waking of any thread
    std::optional<Timestamp> forgotten;  // holes that ended by then are not kept any more
  };

  Thread& thread(HostIndex host, std::int64_t tid) { return hosts_[host].threads[tid]; }
  // Null: nothing of the thread was seen.
  const Thread* find(HostIndex host, std::int64_t tid) const;
  static Cpu& cpu_of(Host& host, std::int32_t number);
  // What a switch reveals by the thread that leaves its CPU.
  static std::optional<Hole> hole_before(const Cpu& cpu, std::int32_t number, Timestamp time,
                                         const SchedSwitch& event);
  static void leave(Thread& thread, Timestamp time, std::int32_t cpu, bool is_runnable);
  static void enter(Thread& thread, Timestamp time, std::int32_t cpu);
  // It may have left the CPU unseen.
  static void lose_running(Host& host, std::int32_t cpu, std::int64_t tid);
  // Whether the switches have another thread on the CPU.
  static bool has_other(const Host& host, std::int32_t cpu, std::int64_t tid, Timestamp time);
  // Notes that another thread than the CPU's last next_tid spoke there.
  static void displace(Host& host, std::int32_t cpu, Timestamp time);
  static void lose_displaced(Thread& thread, Timestamp time);
  // Moves it to running, wherever it was.
  static void resume(Thread& thread, Timestamp time, std::int32_t cpu);
  // Something happens to the thread: no switch-in of the presumed time follows any more.
  static void drop_presumption(Thread& thread);
  static void wake(Thread& thread, Timestamp time);
  // Who runs on a CPU.
  struct Runner {
    std::int64_t tid = 0;
    std::string_view name{};
    bool is_in_callback = false;
  };
  static Runner runner(const Host& host, std::int64_t tid, std::string_view name);
  // Notes that it ran on the CPU where `waiting` waits, up to `time`.
  static void charge(Thread& waiting, const Runner& by, Timestamp time);
  // The same of all that wait while `tid` runs.
  static void charge_waiting(Host& host, std::int64_t tid, const Thread& running, Timestamp time);
  // Ends the waiting of a thread that was preempted.
  static void stop_waiting(Host& host, std::int64_t tid, Thread& waiting, Timestamp time);

  ByIndex<HostIndex, Host> hosts_;
};

}  // namespace cie::analysis
