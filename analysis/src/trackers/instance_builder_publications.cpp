#include <cie/analysis/namespaced_pid.hpp>

#include "instance_builder.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxUndecided = 4096;

}  // namespace

PendingInstance* InstanceBuilder::running(const Emitter& who) {
  if (!who.thread) return nullptr;
  const auto& open = of_thread(who.thread).open;
  const auto found = std::ranges::find(open.rbegin(), open.rend(), false, [](const auto& run) {
    return run->left_before.has_value() || run->is_end_lost;
  });
  return found != open.rend() ? found->get() : nullptr;
}

void InstanceBuilder::note_left(const PendingInstance& latest, const OfThread& thread) {
  if (latest.callback_facts->is_accounted) return;
  const auto& open = thread.open;
  const auto is_inside = [&latest](const auto& run) { return run->start.time > latest.start.time; };
  const auto is_over = [&](const auto& run) {
    return is_inside(run) || (run->callback == latest.callback && !is_reentrant(latest.callback));
  };
  for (auto run = std::ranges::find_if(open, is_over); run != open.end(); ++run) {
    if ((*run)->left_before) continue;
    const auto& sign = is_inside(*run) && latest.end ? *latest.end : latest.start;
    (*run)->left_before = sign.time;
  }
}

// Numbers that were counted here, as of ROS 2, show nothing of the kind.
void InstanceBuilder::note_lost_ends(CallbackIndex callback, std::uint64_t seq, OfThread& thread,
                                     bool is_start_lost) {
  if (!model_.callbacks[at(callback)].is_accounted || is_reentrant(callback)) return;
  for (auto& run : thread.open) {
    if (run->callback != callback || run->seq >= seq || run->is_end_lost) continue;
    run->is_end_lost = true;
    if (run->node) run->node->end = is_start_lost ? ChainNode::End::lost : ChainNode::End::settled;
  }
}

void InstanceBuilder::note_lost_start(CallbackIndex callback, OfThread& thread) {
  if (!model_.callbacks[at(callback)].is_accounted) return;
  for (auto& run : thread.open) {
    if (run->callback != callback && run->node && run->node->end == ChainNode::End::awaited)
      run->node->end = ChainNode::End::lost;
  }
}

bool InstanceBuilder::is_reentrant(CallbackIndex callback) const {
  return registry_.group_type_of(model_.callbacks[at(callback)]) == GroupType::reentrant;
}

ChainNodeRef InstanceBuilder::node_of(const Emitter& who, const Publish& event) {
  if (event.callback == kNoCallback) {
    auto* runs = running(who);
    return runs == nullptr ? ChainNodeRef{} : node_of(*runs);
  }
  auto& callback = callbacks_[registry_.callback(who, event.callback)];
  for (auto* pending : callback.open) {
    if (pending->seq == event.callback_seq) return node_of(*pending);
  }
  const auto ended = std::ranges::find(callback.answering, event.callback_seq,
                                       [](const ChainNodeRef& node) { return node->seq; });
  if (ended == callback.answering.end()) return {};
  auto node = std::move(*ended);
  callback.answering.erase(ended);
  return node;
}

bool InstanceBuilder::may_be_of_unseen(const EventHead& head, const Emitter& who,
                                       const Publish& event) {
  if (event.callback != kNoCallback || !who.thread) return false;
  const auto& last = of_thread(who.thread).last_activity;
  if (running(who) != nullptr) return false;
  // On a thread that never ran a callback none is missing.
  return last && recording_.loss_times().any_between(who.host, *last, head.time);
}

bool InstanceBuilder::may_have_ended(const EventHead& head, const PendingInstance& pending) const {
  const auto& losses = recording_.loss_times();
  const auto start = pending.start.time;
  return losses.any_bound_between(pending.host, start, head.time) ||
         (pending.stream != head.stream && losses.any_between(pending.host, start, head.time));
}

void InstanceBuilder::leave_undecided(UndecidedPublication publication) {
  if (undecided_.size() >= kMaxUndecided) undecided_.erase(undecided_.begin());
  undecided_.push_back(publication);
}

void InstanceBuilder::decide(ThreadIndex thread, PendingInstance* ended) {
  const auto is_decided = [&](const UndecidedPublication& publication) {
    return publication.thread == thread &&
           (ended == nullptr ||
            (publication.callback == ended->callback && publication.seq == ended->seq));
  };
  if (ended != nullptr) {
    for (const auto& publication : undecided_) {
      if (!is_decided(publication)) continue;
      chains_.on_publish(publication.publisher, publication.where, publication.source_timestamp,
                         node_of(*ended));
    }
  }
  std::erase_if(undecided_, is_decided);
}

void InstanceBuilder::apply(const EventHead& head, const Emitter& who, const Publish& event) {
  if (!who.process) return;
  Registry::note_reported(head, registry_.process_facts_of(who));
  const auto index = registry_.publisher(who, event.publisher);
  auto& facts = model_.publishers[index];
  facts.is_accounted = !head.is_derived;
  const bool follows = registry_.note_publication(event.seq, ref(head), index, facts);
  const auto* runs = event.callback == kNoCallback ? running(who) : nullptr;
  if (may_be_of_unseen(head, who, event)) {
    chains_.on_publish_unseen(index, event.source_timestamp_realtime_ns);
  } else if (runs != nullptr &&
             (!follows || event.is_runner_unknown || may_have_ended(head, *runs))) {
    chains_.on_publish_unseen(index, event.source_timestamp_realtime_ns);
    leave_undecided({.thread = *who.thread,
                     .callback = runs->callback,
                     .seq = runs->seq,
                     .publisher = index,
                     .where = ref(head),
                     .source_timestamp = event.source_timestamp_realtime_ns});
  } else {
    chains_.on_publish(index, ref(head), event.source_timestamp_realtime_ns, node_of(who, event));
  }
  if (observer_ == nullptr) return;
  const Publication publication{.time = head.time,
                                .pid = plain_pid(*head.pid),
                                .tid = head.tid.value_or(-1),
                                .cpu = head.cpu,
                                .topic = facts.topic,
                                .publisher_id = to_number(event.publisher),
                                .seq = event.seq,
                                .writer_gid = facts.writer_gid,
                                .source_timestamp_realtime_ns = event.source_timestamp_realtime_ns,
                                .host = who.host,
                                .process = *who.process};
  if (facts.awaited_since) [[unlikely]] {
    held_publications_.add(index, publication);
  } else {
    observer_->on_publication(publication);
  }
}

}  // namespace cie::analysis
