// Payloads of the state events, field for field as the contract lists them. Strings are borrowed
// for the duration of the call that emits them.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <cstdint>

namespace cie::trace {

struct RunBeginEvent {
  const char* tool_version;
  const char* executor;
  const char* boot_id;
  const char* host;
  std::uint32_t pid;
  std::uint64_t pid_ns;
  std::int64_t process_start_ns;
  std::int64_t monotonic_ns;
  std::int64_t realtime_ns;
  std::uint32_t online_cpus;
  const char* spec_sha256;
  RunMoment moment;
};

struct RunEndEvent {
  std::uint32_t callbacks = 0;
  std::uint32_t threads = 0;
  std::uint32_t groups = 0;
  std::uint32_t publishers = 0;
  std::int32_t status = 0;
};

struct CallbackInitEvent {
  std::uint32_t callback_id;
  std::uint32_t group_id;
  std::uint32_t node_id;
  CallbackKind kind;
  const char* logical_id;
  const char* source;
  const char* symbol;
  std::uint64_t period_ns;
  std::uint32_t queue_depth;
  std::uint64_t deadline_ns;
  std::uint64_t next_seq;
};

struct CallbackFiniEvent {
  std::uint32_t callback_id;
  std::uint64_t started;
  std::uint64_t ended;
  std::uint64_t released;
  std::uint64_t overwritten;
  std::uint64_t lost;
};

struct ThreadInitEvent {
  std::uint32_t tid;
  ThreadRole role;
  std::uint32_t callback_id;
  std::uint32_t group_id;
  const char* name;
  std::int64_t start_ns;
};

struct ThreadSchedEvent {
  std::uint32_t tid;
  SchedMoment moment;
  std::uint32_t n;
  std::int32_t policy;
  std::uint64_t flags;
  std::int32_t nice;
  std::uint32_t priority;
  std::uint64_t runtime_ns;
  std::uint64_t deadline_ns;
  std::uint64_t period_ns;
  const std::uint32_t* cpus;
  std::uint32_t cpu_count;
  std::int32_t error;
  std::uint64_t slice_ns;
  std::uint32_t util_min;
  std::uint32_t util_max;
  std::uint32_t change;
};

}  // namespace cie::trace
