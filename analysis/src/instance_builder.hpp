// Pairs starts with ends per thread and turns each pair into an Instance with its release, its four
// parts and its place in the window; feeds the statistics, the witnesses and the observer.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>

#include "chain_tracker.hpp"
#include "facts.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"
#include "thread_timeline.hpp"

#include <deque>
#include <memory>
#include <unordered_map>
#include <vector>

namespace cie::analysis {

class InstanceBuilder {
 public:
  InstanceBuilder(Model& model, Registry& registry, RecordingTracker& recording,
                  ThreadTimeline& timeline, ChainTracker& chains, Observer* observer)
      : model_(model),
        registry_(registry),
        recording_(recording),
        timeline_(timeline),
        chains_(chains),
        observer_(observer) {}

  void apply(const EventHead& head, const CallbackStart& event);
  void apply(const EventHead& head, const CallbackEnd& event);
  void apply(const EventHead& head, const ThreadWakeup& event);
  void apply(const EventHead& head, const Publish& event);
  void apply(const EventHead& head, const ClockSync& event);
  void thread_began(HostIndex host, ThreadIndex thread);
  // Finalises instances that nothing later in the trace can change any more.
  void advance(Timestamp now);
  void finish();

  // On-CPU time of a thread inside its instances so far; empty where its record is broken.
  std::optional<Duration> inside_execution(ThreadIndex thread, HostIndex host, Timestamp now);

 private:
  // A started instance; kept until nothing later can change what is known of it.
  struct Live {
    CallbackIndex callback{};
    std::optional<ThreadIndex> thread;
    HostIndex host{};
    StreamIndex stream{};
    std::uint64_t seq = 0;
    EventRef start;
    std::optional<EventRef> end;
    CallbackStatus status = CallbackStatus::ok;
    ReleaseKind release_kind = ReleaseKind::none;
    std::int64_t release_ns = -1;
    std::uint32_t missed = 0;
    std::int64_t source_timestamp = 0;
    std::uint64_t writer_gid = 0;
    std::optional<std::int64_t> realtime_offset;  // CLOCK_REALTIME - CLOCK_MONOTONIC at the start
    std::optional<Timestamp> wakeup;
    ThreadTimeline::Wake wake;
    ThreadTimeline::Mark mark;
    std::optional<ThreadTimeline::Parts> parts;
    std::shared_ptr<ChainNode> node;
    bool is_nested = false;  // began inside another instance of its thread
    std::optional<std::pair<CallbackIndex, EventRef>> first_inner;        // E3
    std::optional<std::pair<std::uint64_t, EventRef>> first_overlapping;  // E2: seq, start
  };
  struct OfThread {
    std::vector<std::unique_ptr<Live>> open;  // a stack: nested starts lie above
    std::optional<Timestamp> wakeup;
    Duration inside;  // on-CPU time inside outermost instances that ended
    bool is_inside_known = true;
  };
  struct Ended {  // recently ended instances of a callback
    std::uint64_t seq = 0;
    EventRef start;
    EventRef end;
    std::optional<Timestamp> release;  // exact
    bool is_counted = false;
  };
  struct OfCallback {
    std::vector<Live*> open;
    std::deque<Ended> recent;    // at most kRecent, for second ends
    std::deque<Ended> arrivals;  // finalised ones, for inter-arrival times
  };

  OfThread& of_thread(const std::optional<ThreadIndex>& thread);
  void note_on_thread(const Live& live);
  void note_end_without_start(const EventHead& head, CallbackIndex index, std::uint64_t seq);
  void close(std::unique_ptr<Live> live);
  void abandon(std::unique_ptr<Live> live);
  void finalize(const Live& live);
  void count(const Live& live, const Instance& instance);
  void note_arrival(const Live& live, const Instance& instance);
  Instance instance_of(const Live& live) const;
  // When the sample taken was written, on this host's CLOCK_MONOTONIC; empty where that is unknown.
  std::optional<Timestamp> source_time(const Live& live) const;
  bool is_settled(const Live& live, Timestamp now) const;
  bool is_isolated_thread(const Live& live) const;

  Model& model_;
  Registry& registry_;
  RecordingTracker& recording_;
  ThreadTimeline& timeline_;
  ChainTracker& chains_;
  Observer* observer_;
  std::unordered_map<std::uint32_t, OfThread> threads_;  // by ThreadIndex; kNoId: no tid
  std::unordered_map<CallbackIndex, OfCallback> callbacks_;
  std::unordered_map<HostIndex, std::int64_t> realtime_offsets_;
  std::deque<std::unique_ptr<Live>> pending_;  // ended, in order of their ends
};

}  // namespace cie::analysis
