// What waits for a callback: its releases, those that took the place of others, and samples that
// never reached it. Messages that were not sent.
#pragma once

#include <cie/analysis/event.hpp>

#include "model/facts.hpp"
#include "registry.hpp"

#include <algorithm>

namespace cie::analysis {

class QueueTracker {
 public:
  // Both are borrowed.
  QueueTracker(Model& model, Registry& registry) : model_(model), registry_(registry) {}

  // `is_snapshot`: the events are a snapshot's, and what they do not show may be long ago.
  void apply(const EventHead& head, const Emitter& who, const CallbackRelease& event,
             bool is_snapshot) {
    if (!who.process) return;
    auto& callback = model_.callbacks[at(registry_.released(who, event.callback))];
    if (callback.releases++ == 0) callback.overwritten_at_first = event.overwritten;
    note_length(callback, event, is_snapshot);
    if (event.may_be_another && !callback.own) callback.keep_own_apart(ref(head));
    if (event.overwritten > callback.overwritten) {
      if (callback.own && !event.may_be_another)
        callback.own->overwritten += event.overwritten - callback.overwritten;
      callback.overwritten = event.overwritten;
      callback.overwritten_at = ref(head);
    }
  }

  void apply(const EventHead& head, const Emitter& who, const SampleLost& event) {
    if (!who.process) return;
    auto& callback = model_.callbacks[at(registry_.released(who, event.callback))];
    if (event.total <= callback.lost) return;
    if (!callback.lost_at_first)
      callback.lost_at_first = event.total - std::min<std::uint64_t>(event.total, event.count);
    callback.lost = event.total;
    callback.lost_at = ref(head);
  }

  // Threads that publish at once may tell their totals in another order.
  void apply(const Emitter& who, const PublishFailed& event) {
    if (!who.process || event.total == 0) return;
    auto& publisher = model_.publishers[registry_.publisher(who, event.publisher)];
    publisher.first_unsent = std::min(publisher.first_unsent.value_or(event.total), event.total);
    publisher.last_unsent = std::max(publisher.last_unsent, event.total);
  }

 private:
  // Numbers count from the beginning of the process, whatever of it was recorded. Which instance
  // is next is not known before the first one or the registration is seen; a snapshot's
  // registration may be long ago. What arrives before the registration waits for what that says is
  // next.
  static void note_length(CallbackFacts& callback, const CallbackRelease& event, bool is_snapshot) {
    callback.first_release =
        std::min(callback.first_release.value_or(event.release_seq), event.release_seq);
    callback.last_release = std::max(callback.last_release, event.release_seq);
    const auto released = event.release_seq + 1;
    const auto left = released > event.overwritten ? released - event.overwritten : 0;
    const bool is_next_known = callback.registered && !is_snapshot;
    if (!callback.starts.last && !is_next_known) {
      if (!is_snapshot) callback.left_unregistered = std::max(callback.left_unregistered, left);
      return;
    }
    const auto started = std::max(is_next_known ? callback.first_next_seq : 0,
                                  callback.starts.last ? *callback.starts.last + 1 : 0);
    if (left > started) callback.longest_queue = std::max(callback.longest_queue, left - started);
  }

  Model& model_;
  Registry& registry_;
};

}  // namespace cie::analysis
