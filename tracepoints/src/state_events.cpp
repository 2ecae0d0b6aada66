#include "state_events.hpp"

#include "clock.hpp"
#include "provider.h"
#include "version.hpp"

namespace cie::trace {

void emit_run_begin(const ProcessInfo& process, ExecutorKind executor,
                    const std::string& spec_sha256, RunMoment moment) noexcept {
  const ClockPair clocks = read_clocks();
  emit::run_begin({.tool_version = kToolVersion,
                   .executor = label(executor).data(),
                   .boot_id = process.boot_id.c_str(),
                   .host = process.host.c_str(),
                   .pid = process.pid,
                   .pid_ns = process.pid_ns,
                   .process_start_ns = process.process_start_ns,
                   .monotonic_ns = clocks.monotonic_ns,
                   .realtime_ns = clocks.realtime_ns,
                   .online_cpus = process.online_cpus,
                   .spec_sha256 = spec_sha256.c_str(),
                   .moment = moment});
}

void emit_clock_sync() noexcept {
  const ClockPair clocks = read_clocks();
  emit::clock_sync(clocks.monotonic_ns, clocks.realtime_ns);
}

void emit_init(const CallbackState& callback) noexcept {
  const CallbackInfo& info = callback.info;
  emit::callback_init({.callback_id = to_number(callback.id),
                       .group_id = to_number(info.group),
                       .node_id = to_number(info.node),
                       .kind = info.kind,
                       .logical_id = info.logical_id.c_str(),
                       .source = info.source.c_str(),
                       .symbol = info.symbol.c_str(),
                       .period_ns = info.period_ns,
                       .queue_depth = info.queue_depth,
                       .deadline_ns = info.deadline_ns,
                       .next_seq = callback.started.load(std::memory_order_acquire)});
}

void emit_init(const PublisherState& publisher) noexcept {
  emit::publisher_init(publisher.id, publisher.node, publisher.topic.c_str(), publisher.writer_gid,
                       publisher.messages.count());
}

void emit_init(const ThreadState& thread) noexcept {
  emit::thread_init({.tid = thread.tid,
                     .role = thread.role,
                     .callback_id = to_number(thread.callback),
                     .group_id = to_number(thread.group),
                     .name = thread.name.c_str(),
                     .start_ns = thread.start_ns});
}

void emit_sched(const ThreadState& thread, const SchedRecord& record) noexcept {
  const SchedReadBack& read = record.parameters;
  emit::thread_sched({.tid = thread.tid,
                      .moment = record.moment,
                      .n = record.n,
                      .policy = read.policy,
                      .flags = read.flags,
                      .nice = read.nice,
                      .priority = read.priority,
                      .runtime_ns = read.runtime_ns,
                      .deadline_ns = read.deadline_ns,
                      .period_ns = read.period_ns,
                      .cpus = read.cpus.data(),
                      .cpu_count = static_cast<std::uint32_t>(read.cpus.size()),
                      .error = record.error,
                      .slice_ns = read.slice_ns,
                      .util_min = read.util_min,
                      .util_max = read.util_max,
                      .change = record.change});
}

void emit_fini(const CallbackState& callback) noexcept {
  // `ended` is read before `started`, so that a callback which is running shows as started only.
  const std::uint64_t ended = callback.ended.load(std::memory_order_acquire);
  emit::callback_fini({.callback_id = to_number(callback.id),
                       .started = callback.started.load(std::memory_order_acquire),
                       .ended = ended,
                       .released = callback.released.load(std::memory_order_acquire),
                       .overwritten = callback.overwritten.load(std::memory_order_acquire),
                       .lost = callback.lost.load(std::memory_order_acquire)});
}

void emit_fini(const PublisherState& publisher) noexcept {
  emit::publisher_fini(publisher.id, publisher.messages.count());
}

void emit_fini(const ThreadState& thread) noexcept {
  emit::thread_fini(thread.tid, thread.read_backs);
}

}  // namespace cie::trace
