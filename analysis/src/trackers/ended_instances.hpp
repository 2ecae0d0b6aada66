// Keeps instances from their ends until nothing later in the trace can change what is known of
// them, and has each measured then.
#pragma once

#include <cie/analysis/event.hpp>

#include "instance_measurer.hpp"
#include "model/clock_differences.hpp"
#include "model/facts.hpp"
#include "pending_instance.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"
#include "thread_timeline.hpp"

#include <cstddef>
#include <deque>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace cie::analysis {

class EndedInstances {
 public:
  // None waits for longer.
  static constexpr Duration kSettleTime = Registry::kAnnouncedWithin;

  // All are borrowed.
  EndedInstances(const Model& model, const Registry& registry, const RecordingTracker& recording,
                 ThreadTimeline& timeline, ChainTracker& chains, InstanceMeasurer& measurer)
      : model_(model),
        registry_(registry),
        recording_(recording),
        timeline_(timeline),
        chains_(chains),
        measurer_(measurer) {}

  // An instance of which nothing is known yet, in the memory of one that was measured if there is
  // any.
  inline std::unique_ptr<PendingInstance> new_instance();
  // It has ended. They come in order of their ends.
  [[gnu::always_inline]] void add(std::unique_ptr<PendingInstance>&& pending) {
    // Without the way through the queue if nothing is to be waited for.
    if (waiting_.empty() && is_settled(*pending, pending->end->time, pending->host)) {
      measure(std::move(pending));
    } else {
      waiting_.push_back(std::move(pending));
    }
  }
  // Measures those that nothing from this event on can change.
  void advance(const EventHead& head) {
    if (!waiting_.empty()) measure_settled(head);
  }
  // Measures it, whatever may follow.
  [[gnu::always_inline]] void measure(std::unique_ptr<PendingInstance>&& pending) {
    measurer_.measure(*pending);
    pending->node.reset();
    if (spare_.size() < kMaxSpare) {
      spare_.push_back(std::move(pending));
    } else {
      pending.reset();
    }
  }
  // The same of all.
  void measure_all();

 private:
  static constexpr std::size_t kMaxSpare = 1024;

  void measure_first();
  void measure_settled(const EventHead& head);
  // All that will ever be told of its callback, its thread and the writers of the messages that led
  // to it was told.
  bool is_announced(const PendingInstance& pending, Timestamp now) const;
  // `now` of the clock of the host `there`.
  bool is_settled(const PendingInstance& pending, Timestamp now, HostIndex there) const;

  const Model& model_;
  const Registry& registry_;
  const RecordingTracker& recording_;
  ThreadTimeline& timeline_;
  ChainTracker& chains_;
  InstanceMeasurer& measurer_;
  std::deque<std::unique_ptr<PendingInstance>> waiting_;
  std::vector<std::unique_ptr<PendingInstance>> spare_;  // measured, to be used again
};

[[gnu::always_inline]] inline std::unique_ptr<PendingInstance> EndedInstances::new_instance() {
  if (spare_.empty()) return std::make_unique<PendingInstance>();
  auto pending = std::move(spare_.back());
  spare_.pop_back();
  // Cheaper than assigning PendingInstance{}: what is optional and absent is not written, as it would
  // be by std::construct_at() as well.
  std::destroy_at(pending.get());
  ::new (static_cast<void*>(pending.get())) PendingInstance;
  return pending;
}

[[gnu::always_inline]] inline bool EndedInstances::is_settled(const PendingInstance& pending,
                                                              Timestamp now,
                                                              HostIndex there) const {
  const auto shift = there == pending.host
                         ? Duration{}
                         : clock_shift(model_.hosts[at(there)], model_.hosts[at(pending.host)]);
  if (now + shift - pending.end->time > kSettleTime) return true;
  // Nothing of the kernel came yet: its first switch tells what ran until then.
  const bool is_kernel_silent =
      recording_.has_kernel(pending.host) && !model_.hosts[at(pending.host)].has_switches;
  if (is_kernel_silent) return false;
  return is_announced(pending, now + shift) &&
         timeline_.is_confirmed(pending.host, pending.end->time);
}

[[gnu::always_inline]] inline bool EndedInstances::is_announced(const PendingInstance& pending,
                                                                Timestamp now) const {
  const auto& callback = *pending.callback_facts;
  if (!callback.registered) return false;
  if (pending.node && chains_.awaits_message(*pending.node, now)) return false;
  if (pending.thread_facts == nullptr || pending.thread_facts->announced) return true;
  // Nobody announces threads of what follows from other events, unless the process has own ones.
  // A message may be taken before its publication is put together, with which the publisher comes.
  return !callback.is_accounted && !pending.process_facts->run_begin &&
         (pending.writer_gid == 0 || pending.written ||
          (pending.source_timestamp < 0
               ? chains_.is_published(*pending.node)
               : registry_.publisher_by_gid(pending.host, pending.writer_gid).has_value()));
}

}  // namespace cie::analysis
