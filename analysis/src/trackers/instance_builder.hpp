// Pairs starts with ends per thread, and notes what does not pair, overlaps or nests.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>

#include "chain_tracker.hpp"
#include "ended_instances.hpp"
#include "held_publications.hpp"
#include "host_clocks.hpp"
#include "instance_measurer.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/few.hpp"
#include "model/optional_time.hpp"
#include "model/recent.hpp"
#include "pending_instance.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"
#include "thread_timeline.hpp"
#include "timer_grid.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace cie::analysis {

class InstanceBuilder {
 public:
  InstanceBuilder(Model& model, Registry& registry, RecordingTracker& recording,
                  ThreadTimeline& timeline, HostClocks& clocks, ChainTracker& chains,
                  const SchedulingSpec* spec, Observer* observer)
      : model_(model),
        registry_(registry),
        recording_(recording),
        timeline_(timeline),
        clocks_(clocks),
        chains_(chains),
        is_asked_for_cpus_(asks_for_cpus(spec)),
        observer_(observer),
        measurer_(model, registry, recording, timeline, clocks, chains, observer),
        ended_(model, registry, recording, timeline, chains, measurer_),
        held_publications_(model, observer) {}

  // `who`: of the registry, for this event.
  void apply(const EventHead& head, const Emitter& who, const CallbackStart& event);
  // The same of a thread's whose end is told with it, at that time, on a host whose kernel tells
  // nothing.
  void apply_with_end(const EventHead& head, const Emitter& who, const CallbackStart& event,
                      Timestamp end);
  void apply(const EventHead& head, const Emitter& who, const CallbackEnd& event);
  void apply(const EventHead& head, const Emitter& who, const ThreadWakeup& event);
  void apply(const EventHead& head, const Emitter& who, const Publish& event);
  void thread_began(HostIndex host, ThreadIndex thread);
  // What began before is not looked at; its numbers may not have been seen.
  void begin_window(Timestamp from) noexcept { window_begin_ = from; }
  // An instance that is not looked at, because it began before the window, begins and ends.
  void begin_outside(const EventHead& head, const Emitter& who, CallbackIndex callback,
                     std::uint64_t seq);
  void end_outside(const EventHead& head, const Emitter& who, CallbackIndex callback,
                   std::uint64_t seq);
  // One that began outside, before or after it: it tells of its timer's grid, and what kept its thread.
  void pass_start(const EventHead& head, const Emitter& who, CallbackIndex callback,
                  std::uint64_t seq);
  void pass_end(const EventHead& head, const Emitter& who, CallbackIndex callback,
                std::uint64_t seq);
  // What woke the thread was of an instance that ended before the window.
  void forget_wakes(const EventHead& head, const Emitter& who);
  // What the thread runs executes no longer.
  void on_exit(const EventHead& head, HostIndex host, std::int64_t tid);
  // Such an instance may run on the thread.
  bool is_inside_unseen(ThreadIndex thread) { return threads_[thread].unseen > 0; }
  // The thread runs something, as far as is seen.
  bool is_running(const Emitter& who) {
    return who.thread && (!threads_[*who.thread].open.empty() || is_inside_unseen(*who.thread));
  }
  // Instances of the callback that began in the window and have not ended yet.
  std::size_t open_count(CallbackIndex callback) { return callbacks_[callback].open.size(); }
  bool is_open(CallbackIndex callback, std::uint64_t seq);
  // A publisher was announced, which may have published before.
  void publisher_announced() { held_publications_.tell_announced(); }
  // A process of the host has read its clocks.
  void clocks_were_read(HostIndex host) { measurer_.clocks_were_read(host); }
  // A hole in the kernel's record is told of now. Those that wait see it.
  void hole_was_told(HostIndex host, const ThreadTimeline::Hole& hole, Timestamp now) {
    if (now - hole.begin > EndedInstances::kSettleTime) measurer_.hole_was_told(host, hole);
  }
  // Finalises instances that nothing later in the trace can change any more.
  void advance(const EventHead& head) { ended_.advance(head); }
  void finish();
  // Lists what has begun and not ended so far (CallbackFacts::running).
  void look();
  // The thread will run its callback soon: what that takes will be in the cache. First what is found by
  // index, then what lies where only that tells.
  void prefetch(const KnownEmitter& runner) const noexcept;
  void prefetch_start(const KnownEmitter& runner) const noexcept;

  // On-CPU time of a thread inside its instances so far; empty where its record is broken.
  std::optional<Duration> inside_execution(ThreadIndex thread, HostIndex host, Timestamp now);

 private:
  static constexpr std::size_t kRecentEnds = 16;

  // What every instance touches lies in one cache line: here, and of a callback.
  struct alignas(64) OfThread {
    Few<std::unique_ptr<PendingInstance>> open;  // a stack: nested starts lie above
    OptionalTime wakeup;
    OptionalTime nothing_until;  // it woke up then and found nothing to do
    OptionalTime last_activity;  // the latest start or end
    Timestamp busy_since;        // until then: that instances followed each other at once
    OptionalTime waited_since;   // its executor looked for work then, before it did last
    std::uint32_t unseen = 0;    // instances that began before the window and have not ended
    bool has_waited = false;  // an executor runs on it that looks for work in the order it does it
  };
  static_assert(sizeof(OfThread) == 64);
  // On-CPU time of a thread inside outermost instances that ended.
  struct Inside {
    Duration time;
    bool is_known = true;
  };
  // It is of this instance if that ends after it.
  struct UndecidedPublication {
    ThreadIndex thread{};
    CallbackIndex callback{};
    std::uint64_t seq = 0;  // of the callback's instance
    std::uint32_t publisher = 0;
    EventRef where;
    std::int64_t source_timestamp = 0;
  };
  struct BegunOutside {  // before the window
    std::uint64_t seq = 0;
    std::optional<ThreadIndex> thread{};
  };
  struct Ended {  // recently ended instances of a callback
    std::uint64_t seq = 0;
    EventRef end;
  };
  struct TimerStart {
    Timestamp time;
    std::uint64_t seq = 0;
    StreamIndex stream{};
  };
  struct alignas(64) OfCallback {
    Few<PendingInstance*> open;
    CallbackOnThread* last_on = nullptr;  // where it did something last
    Recent<Ended, kRecentEnds> recent;    // for second ends
    std::unique_ptr<TimerGrid> grid;
    std::vector<ChainNodeRef> answering;     // ended, of services: they may respond afterwards
    std::optional<TimerStart> last_start{};  // of timers, be it outside the window
    std::vector<ThreadIndex> ran_on;         // those of its facts, which are larger by far
  };

  [[gnu::always_inline]] OfThread& of_thread(const std::optional<ThreadIndex>& thread) {
    return thread ? threads_[*thread] : nobody_;
  }
  // Made when it is asked for: most instances have no part in a chain.
  const ChainNodeRef& node_of(PendingInstance& pending);
  // The innermost instance that its thread runs, as far as is seen; null: none.
  PendingInstance* running(const Emitter& who);
  // An instance of the thread begins, or has ended. What it began in is over if it is of the same
  // callback, which does not begin inside itself, and so is what began inside it.
  void note_left(const PendingInstance& latest, const OfThread& thread);
  // Number `seq` of the callback ran on the thread after those of it that are open there: their ends
  // were lost. `is_start_lost`: what they are taken to have published may be another one's.
  void note_lost_ends(CallbackIndex callback, std::uint64_t seq, OfThread& thread,
                      bool is_start_lost);
  // An instance of the callback ended that was not seen to begin: what instances of others that are open
  // on its thread are taken to have published may be its own.
  void note_lost_start(CallbackIndex callback, OfThread& thread);
  // As far as its group is told.
  bool is_reentrant(CallbackIndex callback) const;
  // It names none, and one may be open whose start was lost. One that began before the window is no
  // part of a chain, nor is what it publishes.
  bool may_be_of_unseen(const EventHead& head, const Emitter& who, const Publish& event);
  // What its thread runs may have ended since, unseen: then another instance publishes.
  bool may_have_ended(const EventHead& head, const PendingInstance& pending) const;
  void leave_undecided(UndecidedPublication publication);
  // An instance of the thread ended. Null: one whose start was not seen.
  void decide(ThreadIndex thread, PendingInstance* ended);
  // The instance that a publication is of; null: of none.
  ChainNodeRef node_of(const Emitter& who, const Publish& event);
  // `index`: of its callback. The last two: what is kept of where it runs and of the callback.
  inline std::unique_ptr<PendingInstance> begin(const EventHead& head, const Emitter& who,
                                                const CallbackStart& event, CallbackIndex index,
                                                OfThread& on_thread, OfCallback& callback);
  inline void bound_open(OfThread& thread);
  inline void note_on_thread(PendingInstance& pending, OfCallback& callback);
  // The thread was announced for another callback by then.
  void note_beside_other(const PendingInstance& pending, CallbackOnThread& pair);
  // Some entry of it is about CPUs.
  static bool asks_for_cpus(const SchedulingSpec* spec);
  // An instance starts or ends there.
  void note_activity(CallbackOnThread& pair, const EventRef& where) const {
    auto& last = pair.last_activity;
    if (is_asked_for_cpus_ && where.cpu != last.cpu) [[unlikely]] {
      if (last.cpu) note_cpu(pair.cpus, last);
      if (where.cpu) note_cpu(pair.cpus, where);
    }
    last = where;
  }
  void note_moves(CallbackIndex callback, const CallbackOnThread& before, ThreadIndex to,
                  const EventRef& first_on_to, std::uint64_t first_seq);
  static void note_move(CallbackFacts& facts, const CallbackOnThread& from, ThreadIndex to,
                        const EventRef& first_on_to, std::uint64_t first_seq);
  // A callback on a thread; the first time, a new one, of that event.
  CallbackOnThread& pair_of(CallbackIndex callback, ThreadIndex thread, const EventRef& where,
                            std::uint64_t seq);
  void note_missed(const PendingInstance& pending);
  static void note_impossible_release(const PendingInstance& pending, Timestamp release);
  // An instance of a timer whose expiries are known starts.
  void follow_grid(PendingInstance& pending);
  std::optional<TimerGrid::Release> follow_grid(HostIndex host,
                                                const std::optional<ThreadIndex>& thread,
                                                CallbackIndex index, CallbackFacts& facts,
                                                const TimerStart& start, bool is_inside);
  // The thread has looked for work since that time, when something ended, and did not wait for it.
  bool is_busy_since(HostIndex host, ThreadIndex index, Timestamp time, Timestamp now,
                     Duration prompt);
  static void note_start_on_thread(OfThread& thread, Timestamp start) {
    const bool is_pause =
        !thread.last_activity || start - *thread.last_activity > TimerGrid::kPrompt;
    if (is_pause) thread.busy_since = start;
    thread.last_activity = start;
  }
  // An instance that began before the window ended; `thread`: where, if that of its start is not known.
  void leave_unseen(std::optional<ThreadIndex> thread, CallbackIndex callback, std::uint64_t seq);
  // An instance that will not end any more, as its thread is seen for the last time.
  void measure_open(PendingInstance& pending, const ThreadTimeline::Mark& last) const;
  void finish_grid(CallbackIndex index);
  // The kernel's events may tell of its thread.
  bool has_kernel(const PendingInstance& pending) const {
    return recording_.has_kernel(pending.host) && pending.thread_facts->is_known_to_kernel;
  }
  // The thread's last read-back allows it none but CPUs that the kernel's record covers.
  bool is_confined(const PendingInstance& pending) const;
  void note_end_without_start(const EventHead& head, CallbackIndex index, std::uint64_t seq);
  // An instance begins while others of its thread are open. If the last one may have ended since, unseen,
  // then what woke the thread is this one's only where it certainly came after that end.
  void forget_doubtful_wakes(const EventHead& head, PendingInstance& pending,
                             const OfThread& thread, bool follows) const;
  // It ran on the thread, though its start was not seen.
  void note_unseen_run(ThreadIndex thread, const EventRef& end, CallbackIndex index,
                       const CallbackEnd& event);
  // What was woken up and what ran on the thread before belongs to what ended here.
  inline void forget_wakes(OfThread& thread, const Emitter& who, const EventHead& head);
  // It has its end, and is not among those that are open any more.
  inline void close(std::unique_ptr<PendingInstance>&& pending, OfCallback& callback);
  // The same of one whose threads know that it has ended.
  inline void file(std::unique_ptr<PendingInstance>&& pending, OfCallback& callback);
  // An end on another thread than the instance's start, if it certainly is of that one.
  bool end_elsewhere(const EventRef& here, ThreadIndex thread, CallbackIndex index,
                     const CallbackEnd& event);
  // Behind a loss another program may have the pid: the thread was not seen before the instance began.
  bool may_be_of_another_program(const PendingInstance& begun, ThreadIndex thread,
                                 Timestamp now) const;
  void abandon(std::unique_ptr<PendingInstance> pending);

  Model& model_;
  Registry& registry_;
  RecordingTracker& recording_;
  ThreadTimeline& timeline_;
  const HostClocks& clocks_;
  ChainTracker& chains_;
  bool is_asked_for_cpus_;
  Observer* observer_;
  InstanceMeasurer measurer_;
  EndedInstances ended_;
  ByIndex<ThreadIndex, OfThread> threads_;
  OfThread nobody_;  // events without a tid
  ByIndex<ThreadIndex, Inside> inside_;
  // At the thread's last end, where the kernel's record has it.
  ByIndex<ThreadIndex, ThreadTimeline::Mark> left_;
  ByIndex<CallbackIndex, OfCallback> callbacks_;
  Timestamp window_begin_ = kEarliest;
  // That have not ended; of more, some whose ends were lost, the thread of the end is taken for theirs.
  ByIndex<CallbackIndex, std::vector<BegunOutside>> begun_outside_;
  std::vector<UndecidedPublication> undecided_;
  HeldPublications held_publications_;
};

}  // namespace cie::analysis
