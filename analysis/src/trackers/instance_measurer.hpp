// Turns a finished instance into an Instance with its release, its four parts and its place in the
// window; feeds the statistics, the witnesses of the extremes and the observer.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>

#include "base/prefetch.hpp"
#include "chain_tracker.hpp"
#include "host_clocks.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/greatest.hpp"
#include "model/recent.hpp"
#include "pending_instance.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"
#include "thread_timeline.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace cie::analysis {

class InstanceMeasurer {
 public:
  InstanceMeasurer(Model& model, const Registry& registry, RecordingTracker& recording,
                   const ThreadTimeline& timeline, const HostClocks& clocks, ChainTracker& chains,
                   Observer* observer)
      : model_(model),
        registry_(registry),
        recording_(recording),
        timeline_(timeline),
        clocks_(clocks),
        chains_(chains),
        observer_(observer) {}

  // When the sample taken was written, on this host's CLOCK_MONOTONIC; empty where that is unknown.
  OptionalTime source_time(const PendingInstance& pending) const {
    if (pending.written || pending.source_timestamp <= 0) return pending.written;
    return find_source_time(pending);
  }
  // What its release was not before, by its message. Empty: unknown, or CLOCK_REALTIME was set meanwhile,
  // as far as processes have read it until now.
  OptionalTime bound_of_release(const PendingInstance& pending) const {
    const auto written = source_time(pending);
    const bool is_bound =
        written && *written <= pending.start.time && !is_clock_set_meanwhile(pending);
    return is_bound ? written : OptionalTime{};
  }
  // A process of the host has read its clocks: bounds by messages until then are known to be some, or
  // none.
  void clocks_were_read(HostIndex host);
  // No process will any more: nothing speaks against the others.
  void finish();
  // Instances that were measured may be wrong by it: they are no witness of a long execution any more.
  void hole_was_told(HostIndex host, const ThreadTimeline::Hole& hole);
  // An instance of the callback will begin: what measuring it needs will be in the cache by its end.
  void prefetch(CallbackIndex callback) const noexcept {
    prefetch_to_write(bounds_.find(callback));
    prefetch_to_write(arrivals_.find(callback));
  }
  // The same of what is found by the callback's facts: it began.
  void prefetch(const PendingInstance& pending) const noexcept;
  // Once per instance, when nothing later in the trace can change what is known of it.
  void measure(const PendingInstance& pending);
  // A timer's expiries do not follow from the first one after all: its releases become bounds.
  void forget_releases(CallbackIndex index);
  // A prompt start of the timer has proven the calculated releases before it.
  void prove(CallbackIndex index) {
    auto* unproven = unproven_.find(index);
    if (unproven == nullptr) return;
    if (!unproven->rows.empty()) tell_rows(index, *unproven);
    if (!unproven->instances.empty()) count_unproven(index, *unproven);
  }
  // No start will: what they told becomes bounds.
  void leave_bounds(CallbackIndex index);

 private:
  // Between the writing of its message, as far as it tells, and its start.
  bool is_clock_set_meanwhile(const PendingInstance& pending) const {
    return pending.source_timestamp > 0 &&
           clocks_.may_be_set_between(pending.host, pending.source_timestamp, pending.start.time);
  }
  struct Arrival {
    std::uint64_t seq = 0;
    EventRef start;
    EventRef end;
    Timestamp release;  // known
  };
  static_assert(sizeof(Arrival) == 64);
  // Instances whose neighbours, by number, are to come. Most come in order: then it is the latest.
  struct alignas(64) Arrivals {
    static constexpr std::size_t kRemembered = 64;
    Arrival latest;
    bool has_latest = false;
    bool has_previous = false;  // the instance numbered one less than the latest has arrived, too
    bool has_next = false;
    Recent<Arrival, kRemembered> lonely;  // earlier ones that lack a neighbour
    std::uint64_t last_lonely = 0;        // the largest number that was among them
  };
  // The values of a callback's Extremes, in one cache line.
  struct alignas(64) Bounds {
    Greatest response;
    Greatest response_lower;
    Greatest response_upper;
    Greatest duration;
    Greatest execution;
    Greatest duration_without_execution;
    Least min_inter_arrival;
    Greatest max_inter_arrival;
  };

  // What observers will be told of an instance.
  struct Row {
    Instance instance;  // with the calculated release
    std::vector<Preemptor> preempted_by;
  };
  // Measured instances of a timer that count as bounds until a prompt start proves their releases.
  struct Unproven {
    static constexpr std::size_t kMost = 4096;
    static constexpr std::size_t kMostRows = 16 * kMost;  // of all timers, and one for each
    std::vector<Arrival> instances;
    std::vector<Row> rows;  // of these and of those that are not counted
    HostIndex host{};
    bool has_left_bounds = false;
  };

  static Extreme<Duration> extreme_of(const auto& instance, Timestamp release, Duration value) {
    return {.value = value,
            .seq = instance.seq,
            .start = instance.start,
            .end = instance.end,
            .release = release};
  }

  static void note_unmeasured(CallbackFacts& facts, Duration most) {
    facts.longest_unmeasured = std::max(facts.longest_unmeasured.value_or(most), most);
  }

  // By its message; nothing tells yet whether CLOCK_REALTIME was set before it started.
  struct Bounded {
    CallbackIndex callback{};
    std::int64_t source_timestamp = 0;
    Extreme<Duration> upper;
  };
  static constexpr std::size_t kMostBounded = 65'536;  // others are taken for bounds at once

  // What follows from the recording around an instance.
  struct Measured {
    InstanceState state = InstanceState::complete;
    ReleaseSource release_source = ReleaseSource::start;
    Timestamp release;
    OptionalTime unproven;  // a calculated release that no prompt start has proven
    OptionalTime waking;
    const ThreadTimeline::Parts* parts = nullptr;  // of the instance; null: unknown
    bool has_wake_parts = false;                   // of these, blocked and wake delay are known
    std::span<const Preemptor> preempted_by{};     // of these, who ran meanwhile
  };

  static Extreme<Duration> extreme_of(const PendingInstance& pending, const Measured& measured,
                                      Duration value) {
    auto extreme = extreme_of(pending, measured.release, value);
    extreme.release_source = measured.release_source;
    return extreme;
  }

  // It ended in a session that began when the one ended in which it began, or before: `window`.
  bool goes_on_in_next(const CoveredWindow& window, const PendingInstance& pending) const;
  // It is no part of one window, and counts all the same.
  bool counts_outside(const CoveredWindow& window, const PendingInstance& pending);
  // No window has any of it, nor is any of it between sessions where that counts.
  bool is_outside(const CoveredWindow& window, const PendingInstance& pending) const;
  // It ended, and sessions recorded its process before and after it.
  bool is_between_sessions(const PendingInstance& pending) const;
  // It is recorded, and no part of one window. `has_part`: it lies in it partly.
  void note_outside(const PendingInstance& pending, const Measured& measured, bool has_part);
  // Its release is known: its neighbours, by number, may be inside or outside.
  void note_arrival_outside(CallbackFacts& facts, CallbackIndex callback, const Arrival& arrived);
  // The same of an instance inside whose former neighbour is not.
  void note_beside_outside(CallbackFacts& facts, CallbackIndex callback, const Arrival& arrived);
  static void note_pair_outside(InstancesOutside& outside, const Arrival& one,
                                const Arrival& other);
  // `is_inside`: it began and ended in the window.
  inline Measured measured(const PendingInstance& pending, bool is_inside) const;
  // What observers are told.
  Instance instance_of(const PendingInstance& pending, const Measured& measured) const;
  inline bool may_be_written_after(const PendingInstance& pending, Timestamp time) const;
  inline OptionalTime woken(const PendingInstance& pending, const Measured& measured) const;
  inline void find_release(const PendingInstance& pending, Measured& measured) const;
  OptionalTime find_source_time(const PendingInstance& pending) const;
  inline bool is_isolated_thread(const PendingInstance& pending) const;
  // The kernel's record is whole wherever the instance may have run.
  bool is_recorded(const PendingInstance& pending) const;
  // An exception ended it: what shows that it is over shows no end that was lost.
  bool is_left(const PendingInstance& pending) const;
  // Its wake is what woke the thread last before the instance: no later wake-up may be missing.
  inline bool is_woken_last(const PendingInstance& pending) const;
  inline void count(const PendingInstance& pending, const Measured& measured);
  inline void note_response_time(const PendingInstance& pending, const Measured& measured,
                                 Bounds& bounds);
  inline void note_parts(const PendingInstance& pending, const Measured& measured, Bounds& bounds);
  static inline Duration least_response(const PendingInstance& pending, const Measured& measured);
  // It is the callback's own, and others may be another one's.
  static void note_own(const PendingInstance& pending, const Measured& measured, OwnInstances& own);
  // An instance whose release is known.
  inline void note_known(CallbackFacts& facts, Bounds& bounds, const Arrival& instance,
                         const Measured& measured);
  // Returns where it has to be written: it is the latest.
  inline Arrivals& note_arrival(CallbackFacts& facts, CallbackIndex callback, HostIndex host,
                                const Arrival& arrived, Bounds& bounds);
  static bool is_unproven(const PendingInstance& pending) {
    return pending.proven_by > pending.callback_facts->grid.prompt_starts;
  }
  // What was longest by more than responses alone: witnesses that may have any release. Null: none.
  static std::array<Extreme<Duration>*, 4> longest_of(CallbackFacts& facts) {
    const auto known = [](auto& extreme) { return extreme ? &*extreme : nullptr; };
    return {known(facts.max_response_lower), known(facts.max_duration), known(facts.max_execution),
            known(facts.max_duration_without_execution)};
  }
  // An instance with an upper bound by its message.
  void note_bounded(const PendingInstance& pending, const Measured& measured, Timestamp written,
                    Bounds& bounds);
  void take_bound(const Bounded& bounded);
  static void note_upper(CallbackFacts& facts, Bounds& bounds, const Extreme<Duration>& upper);
  void keep_unproven(CallbackIndex index, HostIndex host, const Arrival& instance);
  void count_unproven(CallbackIndex index, Unproven& unproven);
  // Keeps the row until its release is proven.
  void hold_back(const PendingInstance& pending, const Measured& measured);
  void tell_rows(CallbackIndex index, Unproven& unproven);
  void tell_bounds(CallbackIndex index, Unproven& unproven);
  static ReleaseBeforeEnd before_end(const Arrival& earlier, const Arrival& later) {
    return {.seq = earlier.seq,
            .start = earlier.start,
            .end = earlier.end,
            .next_release = later.release,
            .next_start = later.start};
  }
  // Two instances with consecutive numbers.
  static void note_pair(CallbackFacts& facts, Bounds& bounds, const Arrival& earlier,
                        const Arrival& later);
  inline bool are_in_a_row(const CallbackFacts& facts, HostIndex host, const Arrival& one,
                           const Arrival& other) const;
  static void note_gap(CallbackFacts& facts, Bounds& bounds, Duration gap, const Arrival& later);
  static void note_extremes(CallbackFacts& facts, Bounds& bounds, Duration gap,
                            const Arrival& later);
  static void note_release_before_end(CallbackFacts& facts, const Arrival& earlier,
                                      const Arrival& later);
  // Of an instance that never ended: no number of the report, but evidence.
  void note_open_arrival(const PendingInstance& pending, OpenInstance& open);

  Model& model_;
  const Registry& registry_;
  RecordingTracker& recording_;
  const ThreadTimeline& timeline_;
  const HostClocks& clocks_;
  ChainTracker& chains_;
  Observer* observer_;
  ByIndex<CallbackIndex, Arrivals> arrivals_;
  // Latest ones outside.
  ByIndex<CallbackIndex, Recent<Arrival, Arrivals::kRemembered>> arrivals_outside_;
  ByIndex<CallbackIndex, Bounds> bounds_;
  ByIndex<CallbackIndex, Unproven> unproven_;
  ByIndex<HostIndex, std::vector<Bounded>> bounded_;
  std::size_t held_back_ = 0;  // rows, of all timers
};

}  // namespace cie::analysis
