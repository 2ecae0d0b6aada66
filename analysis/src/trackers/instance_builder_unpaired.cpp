// What does not pair: instances outside the window, ends without a start, starts without an end.
#include "instance_builder.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxBegunOutside = 64;  // of a callback

}  // namespace

void InstanceBuilder::begin_outside(const EventHead& head, const Emitter& who,
                                    CallbackIndex callback, std::uint64_t seq) {
  ++of_thread(who.thread).unseen;
  auto& begun = begun_outside_[callback];
  if (begun.size() >= kMaxBegunOutside) begun.erase(begun.begin());
  begun.push_back({.seq = seq, .thread = who.thread});
  pass_start(head, who, callback, seq);
}

void InstanceBuilder::end_outside(const EventHead& head, const Emitter& who, CallbackIndex callback,
                                  std::uint64_t seq) {
  leave_unseen(who.thread, callback, seq);
  pass_end(head, who, callback, seq);
}

void InstanceBuilder::leave_unseen(std::optional<ThreadIndex> thread, CallbackIndex callback,
                                   std::uint64_t seq) {
  if (auto* begun = begun_outside_.find(callback)) {
    const auto found = std::find_if(begun->rbegin(), begun->rend(),
                                    [seq](const BegunOutside& one) { return one.seq == seq; });
    if (found != begun->rend()) {
      thread = found->thread;
      begun->erase(std::next(found).base());
    }
  }
  auto& unseen = of_thread(thread).unseen;
  if (unseen > 0) --unseen;
}

void InstanceBuilder::pass_start(const EventHead& head, const Emitter& who, CallbackIndex callback,
                                 std::uint64_t seq) {
  auto& facts = model_.callbacks[at(callback)];
  if (facts.first_expiry) {
    follow_grid(who.host, who.thread, callback, facts,
                {.time = head.time, .seq = seq, .stream = head.stream}, false);
  }
  note_start_on_thread(of_thread(who.thread), head.time);
}

void InstanceBuilder::pass_end(const EventHead& head, const Emitter& who, CallbackIndex callback,
                               std::uint64_t seq) {
  of_thread(who.thread).last_activity = head.time;
  callbacks_[callback].recent.push(Ended{.seq = seq, .end = ref(head)});
}

void InstanceBuilder::note_unseen_run(ThreadIndex thread, const EventRef& end, CallbackIndex index,
                                      const CallbackEnd& event) {
  const auto& facts = model_.callbacks[at(index)];
  const auto seq = event.seq;
  // Of what began before the recording, or the window, nothing is told.
  const bool is_awaited = facts.registered && seq >= facts.first_next_seq;
  if (!is_awaited) return;
  const bool follows_one_inside = facts.starts.first && seq > *facts.starts.first;
  if (facts.registered->time < window_begin_ && !follows_one_inside) return;
  auto& pair = pair_of(index, thread, end, seq);
  pair.is_certain = pair.is_certain || !event.may_be_another;
  note_activity(pair, end);
  callbacks_[index].last_on = &pair;
}

void InstanceBuilder::note_end_without_start(const EventHead& head, CallbackIndex index,
                                             std::uint64_t seq) {
  auto& facts = model_.callbacks[at(index)];
  auto& callback = callbacks_[index];
  const auto& starts = facts.starts;
  if (!starts.first || seq < *starts.first) {
    ++facts.ends_before_first;
    return;
  }
  const bool was_started = seq <= *starts.last && !registry_.starts(index).is_missing(seq);
  const auto* first_end =
      callback.recent.find_newest([seq](const Ended& ended) { return ended.seq == seq; });
  const bool is_open =
      std::any_of(callback.open.begin(), callback.open.end(),
                  [seq](const PendingInstance* pending) { return pending->seq == seq; });
  if (was_started && !is_open) {
    ++facts.second_ends;
    if (!facts.first_second_end && first_end != nullptr) {
      facts.first_second_end =
          CallbackFacts::SecondEnd{.seq = seq, .first = first_end->end, .second = ref(head)};
    }
    return;
  }
  ++facts.ends_without_start;
  if (!facts.first_end_without_start) facts.first_end_without_start = {seq, ref(head)};
}

bool InstanceBuilder::may_be_of_another_program(const PendingInstance& begun, ThreadIndex thread,
                                                Timestamp now) const {
  const auto start = begun.start.time;
  const auto& facts = model_.threads[at(thread)];
  const auto is_before = [start](const auto& seen) { return seen && seen->time <= start; };
  if (is_before(facts.announced) || is_before(facts.first_seen)) return false;
  return recording_.loss_times().any_between(begun.host, start, now);
}

void InstanceBuilder::abandon(std::unique_ptr<PendingInstance> pending) {
  if (pending->thread && has_kernel(*pending))
    timeline_.end_watch(pending->host, *pending->start.tid, pending->start.time);  // or later
  auto& callback = callbacks_[pending->callback];
  callback.open.remove(pending.get());
  auto& facts = *pending->callback_facts;
  if (pending->first_overlapping && !facts.overlap_unproven) {
    facts.overlap_unproven = overlap_of(*pending);
  }
  if (pending->thread && pending->first_inner && !pending->thread_facts->nesting_unproven) {
    pending->thread_facts->nesting_unproven = nesting_of(*pending);
  }
  if (pending->node && pending->node->end == ChainNode::End::awaited)
    pending->node->end = ChainNode::End::settled;
  ended_.measure(std::move(pending));
}

void InstanceBuilder::measure_open(PendingInstance& pending,
                                   const ThreadTimeline::Mark& last) const {
  if (pending.measured_to || last.time < pending.start.time || !has_kernel(pending)) return;
  pending.parts = ThreadTimeline::between(pending.mark, last);
  pending.measured_to = last.time;
}

void InstanceBuilder::on_exit(const EventHead& head, HostIndex host, std::int64_t tid) {
  const auto thread = registry_.thread_by_tid(host, tid);
  if (!thread) return;
  for (auto& pending : threads_[*thread].open)
    measure_open(*pending, timeline_.mark(host, tid, head.time));
}

void InstanceBuilder::look() {
  for (auto& facts : model_.callbacks)
    facts.running.clear();
  for (const auto& thread : threads_) {
    for (const auto& pending : thread.open) {
      auto& running = pending->callback_facts->running;
      const bool has_ended = pending->left_before.has_value();  // by an exception, untold
      if (!has_ended && running.size() < kMaxOpenListed) running.push_back(open_instance(*pending));
    }
  }
}

void InstanceBuilder::finish() {
  for (auto& facts : model_.callbacks)
    facts.running.clear();
  held_publications_.tell_all();
  ended_.measure_all();
  std::vector<std::unique_ptr<PendingInstance>> open;
  const auto take = [&open](OfThread& state) {
    for (auto& pending : state.open)
      open.push_back(std::move(pending));
    state.open.clear();
  };
  std::for_each(threads_.begin(), threads_.end(), take);
  take(nobody_);
  std::sort(open.begin(), open.end(), [](const auto& a, const auto& b) {
    return std::tie(a->start.time, a->start.tid, a->seq) <
           std::tie(b->start.time, b->start.tid, b->seq);
  });
  for (auto& pending : open) {
    const auto tid = pending->start.tid;
    if (pending->thread && registry_.thread_by_tid(pending->host, *tid) == pending->thread)
      measure_open(*pending, timeline_.mark_at_last_switch(pending->host, *tid));
    abandon(std::move(pending));
  }
  chains_.measure_waiting();
  measurer_.finish();
  for (std::size_t i = 0; i < model_.callbacks.size(); ++i)
    finish_grid(static_cast<CallbackIndex>(i));
}

}  // namespace cie::analysis
