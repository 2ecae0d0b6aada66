// Makes of a recording what a recording of a part of it would be (AnalysisOptions::window): events
// of callbacks outside the window move the numbers that are expected next and the totals that are
// reached, and judge nothing. A flight recorder's snapshot is such a part, of whose past only some
// is left: what had been counted when its window began follows from what is in it.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/time.hpp>

#include "instance_builder.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "registry.hpp"
#include "running_total.hpp"
#include "sequence_tracker.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

namespace cie::analysis {

class WindowCut {
 public:
  WindowCut(const TimeWindow& window, Model& model, Registry& registry, InstanceBuilder& instances)
      : asked_(window), window_(window), model_(model), registry_(registry), instances_(instances) {
    instances_.begin_window(window_.from);
  }

  const TimeWindow& window() const noexcept { return window_; }
  bool is_before(Timestamp time) const noexcept {
    return is_awaiting_begin_ || time < window_.from;
  }
  bool is_after(Timestamp time) const noexcept { return time > window_.to; }

  // The recording is a snapshot: all is before the window until begin_at() says where that begins.
  void await_begin() noexcept { is_snapshot_ = is_awaiting_begin_ = true; }
  bool is_snapshot() const noexcept { return is_snapshot_; }
  bool is_awaiting_begin() const noexcept { return is_awaiting_begin_; }
  void begin_at(Timestamp time) noexcept;

  // A hot event in the window.
  void see_inside(const EventHead& head, const Emitter& who, const EventBody& body);
  // A hot event of a process outside the window.
  void pass_by(const EventHead& head, const Emitter& who, const EventBody& body);
  // A state event, after it was applied: before the window an announcement tells which numbers are next.
  void see_announced(const EventHead& head, const EventBody& body);
  // Whether a state event is to be left out: of threads that were created after the window, and
  // read-backs after it.
  bool leaves_out(const EventHead& head, const EventBody& body);
  // Totals as they were when the window ended. Empty: they cannot be told from those at the end.
  std::optional<CallbackFini> cut(const EventHead& head, const CallbackFini& event);
  PublisherFini cut(const EventHead& head, PublisherFini event);
  ThreadFini cut(const EventHead& head, ThreadFini event);
  RunEnd cut(const EventHead& head, RunEnd event);
  // Once, when everything was seen: counts what the window's begin found counted already.
  void finish();

 private:
  struct OfCallback {
    // Numbers of the first and the last release before the window.
    std::optional<std::uint64_t> first_release;
    std::optional<std::uint64_t> last_release;
    std::uint64_t next_announced = 0;  // number of a start, before the window
    RunningTotal overwritten;
    RunningTotal lost;
    std::optional<std::uint64_t> next_start;    // number of the first one after the window
    std::optional<std::uint64_t> next_release;  // likewise
    std::uint64_t ends_after = 0;               // of instances that started after it
    std::uint64_t second_ends = 0;              // outside it, of others
    SequenceTracker starts;                     // before it
    SequenceFacts seqs;
    std::set<std::uint64_t> open;          // of them, those that were not seen to end
    std::uint64_t spanning = 0;            // began before it and ended after it
    std::uint64_t ended_inside = 0;        // began before it and ended in it
    std::uint64_t ended_again_inside = 0;  // ended before it, and in it a second time
    bool is_release_known = false;         // of a snapshot: the first release inside was seen
  };

  using TidOf = std::tuple<HostIndex, std::int64_t, std::int64_t>;  // host, pid, tid
  TidOf tid_of(const EventHead& head, std::int64_t tid) const {
    return {registry_.host_of(head), head.pid.value_or(-1), tid};
  }
  static std::uint64_t releases_before(const OfCallback& state);
  // Releases up to the window's end, given how many were seen in it and how many there were.
  static std::uint64_t releases_until(const OfCallback& state, std::uint64_t seen,
                                      std::uint64_t total);
  void before(const EventHead& head, const Emitter& who, const EventBody& body);
  void after(const EventHead& head, const Emitter& who, const EventBody& body);
  // What was missing between the last number inside, or the one that was promised before, and this
  // one after it may lie in the window.
  template <typename Facts>
  void see_beyond(const Facts& facts, const SequenceFacts& inside, SequenceTracker& numbers,
                  std::uint64_t number, const EventRef& where) const;
  void see_beyond(const EventHead& head, const ThreadSched& event);
  // An end of an instance that is not open was seen to start, so that it had ended.
  bool is_second_end(CallbackIndex index, std::uint64_t seq) const;
  // Events of the process's machine may have been lost in the window, until then.
  bool may_lack(ProcessIndex process, Timestamp until) const;
  void conclude_callback(CallbackFacts& facts, OfCallback& state) const;
  void conclude_publisher(PublisherFacts& facts) const;
  void see_inside(const Emitter& who, const CallbackRelease& release);
  void see_inside(const Emitter& who, const SampleLost& lost);
  void see_totals(const EventHead& head, const CallbackFini& event, const CallbackFacts& facts,
                  OfCallback& state) const;
  // The running total just before a release, at most: of those that are missing before it nobody knows
  // which one it rose with.
  static std::uint64_t overwritten_before(const CallbackRelease& release,
                                          const CallbackFacts& facts, const OfCallback& state);
  // Of what was lost and overwritten, what lies in the window.
  void conclude_queue(CallbackFacts& facts, OfCallback& state) const;
  // Those that the window's begin cuts, also those that the end cuts, too.
  std::uint64_t cut_by_begin(const CallbackFacts& facts, const OfCallback& state) const;
  CallbackIndex index_of(const Emitter& who, CallbackId id) {
    return registry_.callback(*who.process, id);
  }

  void note_start_outside(CallbackFacts& facts, Timestamp time) const noexcept;

  TimeWindow asked_;
  TimeWindow window_;
  bool is_snapshot_ = false;
  bool is_awaiting_begin_ = false;
  Model& model_;
  Registry& registry_;
  InstanceBuilder& instances_;
  ByIndex<CallbackIndex, OfCallback> callbacks_;
  ByIndex<std::uint32_t, std::optional<std::uint64_t>> next_publish_;  // by publisher, after it
  using LateThread = std::pair<TidOf, std::int64_t>;                   // and when it was created
  std::set<LateThread> late_threads_;
  std::map<TidOf, std::uint32_t> next_read_back_;
};

}  // namespace cie::analysis
