// The LTTng-UST provider `cie`: the events of the contract (tracepoints/README.md), and the inline
// functions that emit them. Together with provider.cpp and ros2_provider.* the only place with
// LTTng's macros. Without LTTng (CIE_WITH_LTTNG undefined) the functions are empty.
#pragma GCC system_header  // LTTng's macros do not survive this project's warnings

#ifdef CIE_WITH_LTTNG
// clang-format off

#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER cie

#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "provider/provider.h"

#if !defined(CIE_TRACEPOINTS_PROVIDER_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define CIE_TRACEPOINTS_PROVIDER_H

#ifndef LTTNG_UST_TRACEPOINT_HIDDEN_DEFINITION
#define LTTNG_UST_TRACEPOINT_HIDDEN_DEFINITION
#endif
#ifndef LTTNG_UST_TRACEPOINT_PROVIDER_HIDDEN_DEFINITION
#define LTTNG_UST_TRACEPOINT_PROVIDER_HIDDEN_DEFINITION
#endif

#include <lttng/tracepoint.h>
#include <cstdint>
#include "base/clock.hpp"
#include "state.hpp"
#include "version.hpp"

// One enumerator: label and number come from schema.hpp.
#define CIE_LABEL(Enum, name) \
  lttng_ust_field_enum_value(cie::label(cie::Enum::name).data(), static_cast<std::uint8_t>(cie::Enum::name))

LTTNG_UST_TRACEPOINT_ENUM(cie, run_moment, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(RunMoment, start)
  CIE_LABEL(RunMoment, announce)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, group_type, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(GroupType, mutually_exclusive)
  CIE_LABEL(GroupType, reentrant)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, callback_kind, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(CallbackKind, timer)
  CIE_LABEL(CallbackKind, subscription)
  CIE_LABEL(CallbackKind, service)
  CIE_LABEL(CallbackKind, client)
  CIE_LABEL(CallbackKind, waitable)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, thread_role, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(ThreadRole, callback)
  CIE_LABEL(ThreadRole, pool)
  CIE_LABEL(ThreadRole, dispatcher)
  CIE_LABEL(ThreadRole, worker)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, sched_moment, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(SchedMoment, initial)
  CIE_LABEL(SchedMoment, applied)
  CIE_LABEL(SchedMoment, audit)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, wakeup_reason, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(WakeupReason, timer)
  CIE_LABEL(WakeupReason, data)
  CIE_LABEL(WakeupReason, guard)
  CIE_LABEL(WakeupReason, spurious)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, release_kind, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(ReleaseKind, timer)
  CIE_LABEL(ReleaseKind, data)
  CIE_LABEL(ReleaseKind, none)
))

LTTNG_UST_TRACEPOINT_ENUM(cie, callback_status, LTTNG_UST_TP_ENUM_VALUES(
  CIE_LABEL(CallbackStatus, ok)
  CIE_LABEL(CallbackStatus, exception)
))

LTTNG_UST_TRACEPOINT_EVENT(cie, run_begin,
  LTTNG_UST_TP_ARGS(const cie::trace::RunFacts*, run, cie::RunMoment, moment_, const cie::ClockPair*, now),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, contract_version, cie::kContractVersion)
    lttng_ust_field_string(tool_version, cie::kToolVersion)
    lttng_ust_field_string(executor, run->executor_labels.c_str())
    lttng_ust_field_string(boot_id, run->process.boot_id.c_str())
    lttng_ust_field_string(host, run->process.host.c_str())
    lttng_ust_field_integer(std::uint32_t, pid, run->process.pid)
    lttng_ust_field_integer(std::uint64_t, pid_ns, run->process.pid_ns)
    lttng_ust_field_integer(std::int64_t, process_start_ns, run->process.process_start_ns)
    lttng_ust_field_integer(std::int64_t, monotonic_ns, now->monotonic_ns)
    lttng_ust_field_integer(std::int64_t, realtime_ns, now->realtime_ns)
    lttng_ust_field_integer(std::uint32_t, online_cpus, run->process.online_cpus)
    lttng_ust_field_string(spec_sha256, run->spec_sha256.c_str())
    lttng_ust_field_enum(cie, run_moment, std::uint8_t, moment, static_cast<std::uint8_t>(moment_))
    lttng_ust_field_integer(std::int64_t, monotonic_offset_ns, run->process.monotonic_offset_ns)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, run_end,
  LTTNG_UST_TP_ARGS(const cie::trace::RunTotals*, e),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callbacks, e->callbacks)
    lttng_ust_field_integer(std::uint32_t, threads, e->threads)
    lttng_ust_field_integer(std::uint32_t, groups, e->groups)
    lttng_ust_field_integer(std::uint32_t, publishers, e->publishers)
    lttng_ust_field_integer(std::int32_t, status, e->status)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, node_init,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, const char*, name_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, node_id, id)
    lttng_ust_field_string(name, name_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, group_init,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint32_t, node, std::uint8_t, type_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, group_id, id)
    lttng_ust_field_integer(std::uint32_t, node_id, node)
    lttng_ust_field_enum(cie, group_type, std::uint8_t, type, type_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, callback_init,
  LTTNG_UST_TP_ARGS(const cie::trace::CallbackState*, c, std::uint64_t, next),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, cie::to_number(c->id))
    lttng_ust_field_integer(std::uint32_t, group_id, cie::to_number(c->info.group))
    lttng_ust_field_integer(std::uint32_t, node_id, cie::to_number(c->info.node))
    lttng_ust_field_enum(cie, callback_kind, std::uint8_t, kind, static_cast<std::uint8_t>(c->info.kind))
    lttng_ust_field_string(logical_id, c->info.logical_id.c_str())
    lttng_ust_field_string(source, c->info.source.c_str())
    lttng_ust_field_string(symbol, c->info.symbol.c_str())
    lttng_ust_field_integer(std::uint64_t, period_ns, c->info.period_ns)
    lttng_ust_field_integer(std::uint32_t, queue_depth, c->info.queue_depth)
    lttng_ust_field_integer(std::uint64_t, deadline_ns, c->info.deadline_ns)
    lttng_ust_field_integer(std::uint64_t, next_seq, next)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, callback_fini,
  LTTNG_UST_TP_ARGS(const cie::trace::CallbackCounts*, e, std::uint32_t, id),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, started, e->started)
    lttng_ust_field_integer(std::uint64_t, ended, e->ended)
    lttng_ust_field_integer(std::uint64_t, released, e->released)
    lttng_ust_field_integer(std::uint64_t, overwritten, e->overwritten)
    lttng_ust_field_integer(std::uint64_t, lost, e->lost)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, publisher_init,
  LTTNG_UST_TP_ARGS(const cie::trace::PublisherState*, p, std::uint64_t, next),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, publisher_id, cie::to_number(p->id))
    lttng_ust_field_integer(std::uint32_t, node_id, cie::to_number(p->node))
    lttng_ust_field_string(topic, p->topic.c_str())
    lttng_ust_field_integer(std::uint64_t, writer_gid, p->writer_gid)
    lttng_ust_field_integer(std::uint64_t, next_seq, next)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, publisher_fini,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, published_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, publisher_id, id)
    lttng_ust_field_integer(std::uint64_t, published, published_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, thread_init,
  LTTNG_UST_TP_ARGS(const cie::trace::ThreadState*, t),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, tid, t->tid)
    lttng_ust_field_enum(cie, thread_role, std::uint8_t, role, static_cast<std::uint8_t>(t->role))
    lttng_ust_field_integer(std::uint32_t, callback_id, cie::to_number(t->callback))
    lttng_ust_field_integer(std::uint32_t, group_id, cie::to_number(t->group))
    lttng_ust_field_string(name, t->name.c_str())
    lttng_ust_field_integer(std::int64_t, start_ns, t->start_ns)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, thread_fini,
  LTTNG_UST_TP_ARGS(std::uint32_t, tid_, std::uint32_t, read_backs_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, tid, tid_)
    lttng_ust_field_integer(std::uint32_t, read_backs, read_backs_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, thread_sched,
  LTTNG_UST_TP_ARGS(const cie::trace::ThreadState*, t, const cie::trace::SchedRecord*, r),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, tid, t->tid)
    lttng_ust_field_enum(cie, sched_moment, std::uint8_t, moment, static_cast<std::uint8_t>(r->moment))
    lttng_ust_field_integer(std::uint32_t, n, r->n)
    lttng_ust_field_integer(std::int32_t, policy, r->parameters.policy)
    lttng_ust_field_integer(std::uint64_t, flags, r->parameters.flags)
    lttng_ust_field_integer(std::int32_t, nice, r->parameters.nice)
    lttng_ust_field_integer(std::uint32_t, priority, r->parameters.priority)
    lttng_ust_field_integer(std::uint64_t, runtime_ns, r->parameters.runtime_ns)
    lttng_ust_field_integer(std::uint64_t, deadline_ns, r->parameters.deadline_ns)
    lttng_ust_field_integer(std::uint64_t, period_ns, r->parameters.period_ns)
    lttng_ust_field_sequence(std::uint32_t, cpus, r->parameters.cpus.data(), std::uint32_t, static_cast<std::uint32_t>(r->parameters.cpus.size()))
    lttng_ust_field_integer(std::int32_t, error, r->error)
    lttng_ust_field_integer(std::uint64_t, slice_ns, r->parameters.slice_ns)
    lttng_ust_field_integer(std::uint32_t, util_min, r->parameters.util_min)
    lttng_ust_field_integer(std::uint32_t, util_max, r->parameters.util_max)
    lttng_ust_field_integer(std::uint32_t, change, r->change)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, callback_release,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq, std::uint64_t, overwritten_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, release_seq, seq)
    lttng_ust_field_integer(std::uint64_t, overwritten, overwritten_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, thread_wakeup,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint8_t, reason_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_enum(cie, wakeup_reason, std::uint8_t, reason, reason_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, callback_start,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::uint8_t, kind, std::int64_t, release,
                    std::uint32_t, missed_, std::int64_t, source, std::uint64_t, gid),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_enum(cie, release_kind, std::uint8_t, release_kind, kind)
    lttng_ust_field_integer(std::int64_t, release_ns, release)
    lttng_ust_field_integer(std::uint32_t, missed, missed_)
    lttng_ust_field_integer(std::int64_t, source_timestamp_realtime_ns, source)
    lttng_ust_field_integer(std::uint64_t, writer_gid, gid)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, callback_end,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::uint8_t, status_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_enum(cie, callback_status, std::uint8_t, status, status_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, publish,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::int64_t, source),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, publisher_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_integer(std::int64_t, source_timestamp_realtime_ns, source)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, sample_lost,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint32_t, count_, std::uint64_t, total_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint32_t, count, count_)
    lttng_ust_field_integer(std::uint64_t, total, total_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, publish_failed,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::int64_t, source, std::uint64_t, total_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, publisher_id, id)
    lttng_ust_field_integer(std::int64_t, source_timestamp_realtime_ns, source)
    lttng_ust_field_integer(std::uint64_t, total, total_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, deadline_miss,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::int64_t, response,
                    std::uint64_t, deadline),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_integer(std::int64_t, response_ns, response)
    lttng_ust_field_integer(std::uint64_t, deadline_ns, deadline)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie, clock_sync,
  LTTNG_UST_TP_ARGS(std::int64_t, monotonic, std::int64_t, realtime),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::int64_t, monotonic_ns, monotonic)
    lttng_ust_field_integer(std::int64_t, realtime_ns, realtime)
  )
)

#endif  // CIE_TRACEPOINTS_PROVIDER_H

#include <lttng/tracepoint-event.h>
// clang-format on
#else
#define lttng_ust_tracepoint(...) static_cast<void>(0)
#endif  // CIE_WITH_LTTNG

#if !defined(CIE_TRACEPOINTS_EMIT_H) && !defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define CIE_TRACEPOINTS_EMIT_H

#include <cie/tracepoints/schema.hpp>
#include <cie/tracepoints/trace.hpp>

#include "base/clock.hpp"
#include "state.hpp"

#include <cstdint>

// Each function emits one event, if some session records it.
namespace cie::trace::emit {

inline void run_begin(const RunFacts& run, RunMoment moment) noexcept {
  const ClockPair now = read_clocks();
  lttng_ust_tracepoint(cie, run_begin, &run, moment, &now);
}
inline void run_end(const RunTotals& totals) noexcept {
  lttng_ust_tracepoint(cie, run_end, &totals);
}
inline void node_init(NodeId node, const char* name) noexcept {
  lttng_ust_tracepoint(cie, node_init, to_number(node), name);
}
inline void group_init(GroupId group, NodeId node, GroupType type) noexcept {
  lttng_ust_tracepoint(cie, group_init, to_number(group), to_number(node),
                       static_cast<std::uint8_t>(type));
}
inline void callback_init(const CallbackState& callback) noexcept {
  lttng_ust_tracepoint(cie, callback_init, &callback,
                       callback.started.load(std::memory_order_acquire));
}
inline void callback_fini(const CallbackState& callback) noexcept {
  const CallbackCounts counts = counts_of(callback);
  lttng_ust_tracepoint(cie, callback_fini, &counts, to_number(callback.id));
}
inline void publisher_init(const PublisherState& publisher) noexcept {
  lttng_ust_tracepoint(cie, publisher_init, &publisher, publisher.messages.count());
}
inline void publisher_fini(const PublisherState& publisher) noexcept {
  lttng_ust_tracepoint(cie, publisher_fini, to_number(publisher.id), publisher.messages.count());
}
inline void thread_init(const ThreadState& thread) noexcept {
  lttng_ust_tracepoint(cie, thread_init, &thread);
}
inline void thread_fini(const ThreadState& thread) noexcept {
  lttng_ust_tracepoint(cie, thread_fini, thread.tid, thread.read_backs);
}
inline void thread_sched(const ThreadState& thread, const SchedRecord& record) noexcept {
  lttng_ust_tracepoint(cie, thread_sched, &thread, &record);
}
inline void clock_sync() noexcept {
  const ClockPair now = read_clocks();
  lttng_ust_tracepoint(cie, clock_sync, now.monotonic_ns, now.realtime_ns);
}

// The hot ones.
inline void callback_release(CallbackId callback, std::uint64_t release_seq,
                             std::uint64_t overwritten) noexcept {
  lttng_ust_tracepoint(cie, callback_release, to_number(callback), release_seq, overwritten);
}
inline void thread_wakeup(CallbackId callback, WakeupReason reason) noexcept {
  lttng_ust_tracepoint(cie, thread_wakeup, to_number(callback), static_cast<std::uint8_t>(reason));
}
inline void callback_start(CallbackId callback, std::uint64_t seq,
                           const Callback::Release& release) noexcept {
  lttng_ust_tracepoint(cie, callback_start, to_number(callback), seq,
                       static_cast<std::uint8_t>(release.kind), release.release_ns, release.missed,
                       release.source_timestamp_realtime_ns, release.writer_gid);
}
inline void callback_end(CallbackId callback, std::uint64_t seq, CallbackStatus status) noexcept {
  lttng_ust_tracepoint(cie, callback_end, to_number(callback), seq,
                       static_cast<std::uint8_t>(status));
}
// For triggers. Whether anybody asks for it is looked up first: it costs a look at the clock.
inline bool is_deadline_miss_enabled() noexcept {
#ifdef CIE_WITH_LTTNG
  return lttng_ust_tracepoint_enabled(cie, deadline_miss);
#else
  return false;
#endif
}
inline void deadline_miss(CallbackId callback, std::uint64_t seq, std::int64_t response_ns,
                          std::uint64_t deadline_ns) noexcept {
  lttng_ust_tracepoint(cie, deadline_miss, to_number(callback), seq, response_ns, deadline_ns);
}
inline void publish(PublisherId publisher, std::uint64_t seq,
                    std::int64_t source_timestamp_realtime_ns) noexcept {
  lttng_ust_tracepoint(cie, publish, to_number(publisher), seq, source_timestamp_realtime_ns);
}
inline void sample_lost(CallbackId callback, std::uint32_t count, std::uint64_t total) noexcept {
  lttng_ust_tracepoint(cie, sample_lost, to_number(callback), count, total);
}
inline void publish_failed(PublisherId publisher, std::int64_t source_timestamp_realtime_ns,
                           std::uint64_t total) noexcept {
  lttng_ust_tracepoint(cie, publish_failed, to_number(publisher), source_timestamp_realtime_ns,
                       total);
}

}  // namespace cie::trace::emit

namespace cie::trace {

// One bit per event of the provider: those that some session records in this process; and one for
// the events of the profile `ros2`, all together. deadline_miss, which is for triggers, has none.
std::uint32_t enabled_events() noexcept;
inline constexpr std::uint32_t kRos2Events = 1U << 31U;

// Calls `on_start` whenever a tracing session starts on this process or its state is asked for anew
// (`lttng regenerate statedump`), from a thread of LTTng's: it may only set a flag and wake
// someone. False if this LTTng does not tell.
bool watch_session_starts(void (*on_start)() noexcept) noexcept;

// What is called at process exit, after the program's own destructors and before LTTng's.
void at_process_exit(void (*on_exit)() noexcept) noexcept;

}  // namespace cie::trace

#endif  // CIE_TRACEPOINTS_EMIT_H
