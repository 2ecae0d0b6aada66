// Keeps instances from their ends until nothing later in the trace can change what is known of
// them, and has each measured then.
#pragma once

#include <cie/analysis/event.hpp>

#include "instance_measurer.hpp"
#include "model/facts.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"
#include "thread_timeline.hpp"

#include <deque>
#include <memory>
#include <vector>

namespace cie::analysis {

class EndedInstances {
 public:
  // All are borrowed.
  EndedInstances(const Model& model, const Registry& registry, const RecordingTracker& recording,
                 ThreadTimeline& timeline, const ChainTracker& chains, InstanceMeasurer& measurer)
      : model_(model),
        registry_(registry),
        recording_(recording),
        timeline_(timeline),
        chains_(chains),
        measurer_(measurer) {}

  // An instance of which nothing is known yet, in the memory of one that was measured if there is
  // any.
  std::unique_ptr<LiveInstance> new_instance();
  // It has ended. They come in order of their ends.
  void add(std::unique_ptr<LiveInstance> live);
  // Measures those that nothing from this event on can change.
  void advance(const EventHead& head) {
    if (!waiting_.empty()) measure_settled(head);
  }
  // Measures it, whatever may follow.
  void measure(std::unique_ptr<LiveInstance> live);
  // The same of all.
  void measure_all();

 private:
  void measure_first();
  void measure_settled(const EventHead& head);
  // All that will ever be told of its callback, its thread and the writer of its message was told.
  inline bool is_announced(const LiveInstance& live) const;
  // `now` of the clock of the host `there`.
  inline bool is_settled(const LiveInstance& live, Timestamp now, HostIndex there) const;

  const Model& model_;
  const Registry& registry_;
  const RecordingTracker& recording_;
  ThreadTimeline& timeline_;
  const ChainTracker& chains_;
  InstanceMeasurer& measurer_;
  std::deque<std::unique_ptr<LiveInstance>> waiting_;
  std::vector<std::unique_ptr<LiveInstance>> spare_;  // measured, to be used again
};

}  // namespace cie::analysis
