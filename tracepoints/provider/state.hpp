// What the registry and the objects of trace.hpp share about a run, a callback, a publisher or a
// thread: identity, written once at registration, and counters, written on the hot path. State
// events are emitted from it.
#pragma once

#include <cie/tracepoints/trace.hpp>

#include "base/prefetch.hpp"
#include "message_clock.hpp"
#include "process_info.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cie::trace {

struct CallbackState {
  CallbackState(CallbackId callback, CallbackInfo callback_info, bool may_overlap_itself)
      : id(callback),
        may_overlap(may_overlap_itself),
        releases_may_overlap(callback_info.kind == CallbackKind::waitable),
        info(std::move(callback_info)) {}

  // Written by the thread that runs the callback …
  alignas(kCacheLine) std::atomic<std::uint64_t> started{0};
  std::atomic<std::uint64_t> ended{0};
  const CallbackId id;
  const bool may_overlap;  // of a reentrant or unknown group: two threads may count at once
  const bool releases_may_overlap;  // a queue orders its arrivals; anybody may trigger a waitable
  const CallbackInfo info;
  // … and by those that make it ready, on another cache line.
  alignas(kCacheLine) std::atomic<std::uint64_t> released{0};
  std::atomic<std::uint64_t> overwritten{0};
  std::atomic<std::uint64_t> lost{0};
};

struct PublisherState {
  PublisherState(PublisherId publisher, NodeId publisher_node, std::string_view publisher_topic,
                 std::uint64_t gid, std::uint32_t depth)
      : id(publisher),
        node(publisher_node),
        topic(publisher_topic),
        writer_gid(gid),
        queue_depth(depth) {}

  alignas(kCacheLine) MessageClock messages;
  const PublisherId id;
  const NodeId node;
  const std::string topic;
  const std::uint64_t writer_gid;
  const std::uint32_t queue_depth;
};

// How often what happened to a callback.
struct CallbackCounts {
  std::uint64_t started = 0;
  std::uint64_t ended = 0;
  std::uint64_t released = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t lost = 0;
};

// `ended` is read before `started`, so that a callback that runs shows as started only.
inline CallbackCounts counts_of(const CallbackState& callback) noexcept {
  CallbackCounts counts;
  counts.ended = callback.ended.load(std::memory_order_acquire);
  counts.started = callback.started.load(std::memory_order_acquire);
  counts.released = callback.released.load(std::memory_order_acquire);
  counts.overwritten = callback.overwritten.load(std::memory_order_acquire);
  counts.lost = callback.lost.load(std::memory_order_acquire);
  return counts;
}

// One read-back of a thread's parameters, as `thread_sched` carries it.
struct SchedRecord {
  SchedMoment moment{};
  std::uint32_t n = 0;
  std::int32_t error = 0;
  std::uint32_t change = 0;
  SchedReadBack parameters;
};

// What `run_begin` says, but for when.
struct RunFacts {
  ProcessInfo process;
  std::set<ExecutorKind> executors;  // of all runs so far
  std::string executor_labels;
  std::string spec_sha256;  // empty: no spec
};

// Of what was emitted, over the process's lifetime.
struct RunTotals {
  std::uint32_t callbacks = 0;
  std::uint32_t threads = 0;
  std::uint32_t groups = 0;
  std::uint32_t publishers = 0;
  std::int32_t status = 0;  // the greatest of the runs that ended
};

struct ThreadState {
  ThreadRole role{};
  CallbackId callback{};
  GroupId group{};
  std::string name;
  std::uint32_t tid = 0;
  std::int64_t start_ns = 0;
  // Of the OS thread that had the tid then: when the kernel created it. Empty: it does not tell.
  std::optional<std::uint64_t> created_ticks{};
  // Guarded by the registry's lock.
  std::uint32_t read_backs = 0;
  std::uint32_t change = 0;
  std::vector<SchedRecord> unsent;  // read back before the first Run
};

// When the kernel created that thread of this process, in ticks of 10 ms. Empty: there is none, or /proc
// cannot be read.
std::optional<std::uint64_t> created_ticks(std::uint32_t tid);
// The parameters of that OS thread. Empty when it is gone, also if another one has its tid now.
std::optional<SchedReadBack> read_back(const ThreadState& thread);

}  // namespace cie::trace
