#include "recorded_items.hpp"

namespace cie::viewer_export {

using analysis::Duration;
using analysis::Timestamp;

KeptInstance KeptInstance::of(const analysis::Instance& i) {
  KeptInstance kept{.start = i.start.ns,
                    .callback = i.callback,
                    .process = i.process,
                    .missed = i.missed,
                    .seq = i.seq,
                    .source_timestamp = i.source_timestamp_realtime_ns,
                    .writer_gid = i.writer_gid,
                    .release_source = i.release_source,
                    .state = i.state,
                    .status = i.status,
                    .numbers = {}};
  kept.numbers.keep(release, i.release);
  kept.numbers.keep(end, i.end);
  kept.numbers.keep(cpu_start, i.cpu_start);
  kept.numbers.keep(cpu_end, i.cpu_end);
  kept.numbers.keep(execution, i.execution);
  kept.numbers.keep(preempted, i.preempted);
  kept.numbers.keep(blocked, i.blocked);
  kept.numbers.keep(wake_delay, i.wake_delay);
  return kept;
}

RecordedInstance KeptInstance::restored(const ThreadTable& threads) const {
  const auto& of = threads.thread(thread);
  RecordedInstance record{.instance = {}, .name = name, .thread = thread, .index = index};
  auto& i = record.instance;
  i.callback = callback;
  i.process = process;
  i.pid = of.pid;
  i.tid = of.tid;
  i.host = of.host;
  i.seq = seq;
  i.state = state;
  i.status = status;
  i.release = numbers.get<Timestamp>(release);
  i.release_source = release_source;
  i.start = {start};
  i.end = numbers.get<Timestamp>(end);
  i.cpu_start = numbers.get<std::int32_t>(cpu_start);
  i.cpu_end = numbers.get<std::int32_t>(cpu_end);
  i.execution = numbers.get<Duration>(execution);
  i.preempted = numbers.get<Duration>(preempted);
  i.blocked = numbers.get<Duration>(blocked);
  i.wake_delay = numbers.get<Duration>(wake_delay);
  i.missed = missed;
  i.source_timestamp_realtime_ns = source_timestamp;
  i.writer_gid = writer_gid;
  return record;
}

KeptPublication KeptPublication::of(const analysis::Publication& p) {
  return {.time = p.time.ns,
          .publisher_id = p.publisher_id,
          .seq = p.seq,
          .writer_gid = p.writer_gid,
          .source_timestamp = p.source_timestamp_realtime_ns};
}

RecordedPublication KeptPublication::restored(const ThreadTable& threads) const {
  const auto& of = threads.thread(thread);
  return {.publication = {.time = {time},
                          .pid = of.pid,
                          .tid = of.tid,
                          .cpu = {},
                          .topic = {},
                          .publisher_id = publisher_id,
                          .seq = seq,
                          .writer_gid = writer_gid,
                          .source_timestamp_realtime_ns = source_timestamp,
                          .host = of.host},
          .topic = topic,
          .thread = thread,
          .receivers = {}};
}

}  // namespace cie::viewer_export
