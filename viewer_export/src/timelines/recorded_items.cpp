#include "recorded_items.hpp"

namespace cie::viewer_export {

using analysis::Duration;
using analysis::Timestamp;

RecordedInstance restored(const KeptInstance& kept, const ThreadTable& threads) {
  using Kept = KeptInstance;
  const auto& of = threads.thread(kept.thread);
  const auto& numbers = kept.numbers;
  RecordedInstance record{
      .instance = {}, .name = kept.name, .thread = kept.thread, .index = kept.index};
  auto& i = record.instance;
  i.callback = kept.callback;
  i.process = kept.process;
  i.pid = of.pid;
  i.tid = of.tid;
  i.host = of.host;
  i.seq = kept.seq;
  i.state = kept.state;
  i.status = kept.status;
  i.release = numbers.get<Timestamp>(Kept::release);
  i.release_source = kept.release_source;
  i.start = {kept.start};
  i.end = numbers.get<Timestamp>(Kept::end);
  i.cpu_start = numbers.get<std::int32_t>(Kept::cpu_start);
  i.cpu_end = numbers.get<std::int32_t>(Kept::cpu_end);
  i.wakeup = numbers.get<Timestamp>(Kept::wakeup);
  i.waking = numbers.get<Timestamp>(Kept::waking);
  i.execution = numbers.get<Duration>(Kept::execution);
  i.preempted = numbers.get<Duration>(Kept::preempted);
  i.blocked = numbers.get<Duration>(Kept::blocked);
  i.wake_delay = numbers.get<Duration>(Kept::wake_delay);
  i.missed = numbers.get<std::uint32_t>(Kept::missed);
  i.source_timestamp_realtime_ns = kept.source_timestamp;
  i.writer_gid = kept.writer_gid;
  return record;
}

KeptPublication KeptPublication::of(const analysis::Publication& p) {
  return {.time = p.time.ns,
          .publisher_id = p.publisher_id,
          .process = p.process,
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
                          .host = of.host,
                          .process = process},
          .topic = topic,
          .thread = thread,
          .receivers = {}};
}

}  // namespace cie::viewer_export
