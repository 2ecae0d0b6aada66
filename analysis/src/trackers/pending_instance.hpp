// What is known so far of an instance of a callback.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>

#include "chain_node.hpp"
#include "model/facts.hpp"
#include "model/optional_time.hpp"
#include "thread_timeline.hpp"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis {

// A started instance; kept until nothing later can change what is known of it.
struct PendingInstance {
  CallbackIndex callback{};
  std::optional<ThreadIndex> thread;
  CallbackFacts* callback_facts = nullptr;  // the model's
  const ProcessFacts* process_facts = nullptr;
  ThreadFacts* thread_facts = nullptr;  // null without a thread
  HostIndex host{};
  StreamIndex stream{};
  std::uint64_t seq = 0;
  EventRef start;
  std::optional<EventRef> end;
  std::optional<CallbackStatus> status{};
  OptionalTime release;  // exact ones only
  std::uint32_t missed = 0;
  bool is_missed_known = true;
  OptionalTime expiry;          // calculated
  std::uint64_t proven_by = 0;  // as soon as the timer has had so many prompt starts
  std::int64_t source_timestamp = 0;
  std::uint64_t writer_gid = 0;
  OptionalTime written;  // source_time(), as far as it was asked for and known
  std::optional<std::int64_t> realtime_offset;  // CLOCK_REALTIME - CLOCK_MONOTONIC at the start
  OptionalTime wakeup;
  ThreadTimeline::Wake wake;
  // Since then no instance of its thread ran, nor was there anything to do: what woke the thread later
  // is its own. Unknown: an instance may have run that nobody saw.
  OptionalTime alone_since;
  ThreadTimeline::Mark mark;
  std::optional<ThreadTimeline::Parts> parts;
  OptionalTime measured_to;  // of one that never ended: from its start to here are its parts
  std::vector<Preemptor> preempted_by;
  // Its thread may use none but CPUs that the kernel's record covers, by its last read-back.
  bool is_confined = false;
  bool is_writer_undecided = false;  // see CallbackStart
  bool may_be_another = false;       // likewise
  bool is_in_window = false;         // began inside the window
  std::uint64_t read = 0;            // see ChainNode
  ChainNodeRef node;                 // null: it has no part in a chain yet
  CallbackOnThread* pair = nullptr;  // null: its thread is unknown
  OptionalTime left_before;          // by an exception: it ended untold, before then
  bool is_end_lost = false;          // its thread ran its callback again since
  bool is_nested = false;            // began inside another instance of its thread
  std::optional<std::pair<CallbackIndex, EventRef>> first_inner;        // E3
  std::optional<std::pair<std::uint64_t, EventRef>> first_overlapping;  // E2: seq, start
};

// One that starts in the very nanosecond that this one ends in, on another CPU, follows it. Requires
// an end.
template <typename T>
bool has_ended_after(const PendingInstance& pending,
                     const std::optional<std::pair<T, EventRef>>& start) noexcept {
  return start && start->second.time < pending.end->time;
}

// Of one that has not ended.
inline OpenInstance open_instance(const PendingInstance& pending) {
  return {.start = pending.start,
          .seq = pending.seq,
          .release = pending.release,
          .release_exact = pending.release.has_value(),
          .missed = pending.missed,
          .thread = pending.thread.value_or(ThreadIndex{kNoId})};
}

// Of an instance that another one of its callback began in, or that another one began inside of.
inline CallbackFacts::Overlap overlap_of(const PendingInstance& pending) {
  return {.first_seq = pending.seq,
          .first_start = pending.start,
          .first_end = pending.end,
          .second_seq = pending.first_overlapping->first,
          .second_start = pending.first_overlapping->second};
}

inline ThreadFacts::Nesting nesting_of(const PendingInstance& pending) {
  return {.outer = pending.callback,
          .outer_start = pending.start,
          .outer_end = pending.end,
          .inner = pending.first_inner->first,
          .inner_start = pending.first_inner->second};
}

}  // namespace cie::analysis
