#include "perfetto_counters.hpp"

#include "utf8.hpp"

#include <string>

namespace cie::viewer_export::perfetto {

using analysis::Instance;
using analysis::ReleaseSource;

void Counters::see(const Instance& instance, std::string_view name) {
  const auto thread = thread_of(instance);
  auto [at, is_new] = callbacks_.try_emplace(instance.callback);
  auto& callback = at->second;
  if (is_new) {
    callback.thread = thread;
    callback.name = names_.number(name);
  }
  if (callback.thread != thread) callback.has_one_thread = false;
  if (instance.writer_gid == 0) return;  // it took no message
  const bool is_exact = instance.release && instance.release_source == ReleaseSource::exact &&
                        instance.release->ns >= 0 && *instance.release <= instance.start;
  if (!is_exact) {
    callback.is_queue_known = false;
    return;
  }
  arrivals_.add({.callback = instance.callback, .change = 1, .time = instance.release->ns});
  arrivals_.add({.callback = instance.callback, .change = -1, .time = instance.start.ns});
}

std::uint64_t Counters::track(PacketBuffer& packets, Tracks& tracks, const Callback& callback,
                              std::string_view quantity, CounterUnit unit) {
  const auto& thread = callback.thread;
  const auto parent = callback.has_one_thread ? tracks.thread_track(thread)
                                              : tracks.process_track(thread.host, thread.pid);
  const auto uuid = tracks.new_uuid();
  packets.counter_track(uuid, parent,
                        std::string(quantity) + valid_utf8(names_.name(callback.name)), unit);
  return uuid;
}

void Counters::draw_response(PacketBuffer& packets, Tracks& tracks, const Instance& instance) {
  if (!instance.end || !instance.release || instance.release_source != ReleaseSource::exact) return;
  auto& callback = callbacks_.at(instance.callback);
  packets.set_machine(callback.thread.host);
  if (callback.response_track == 0) {
    callback.response_track =
        track(packets, tracks, callback, "response time ", CounterUnit::time_ns);
  }
  packets.count(instance.end->ns, callback.response_track, (*instance.end - *instance.release).ns);
  ++responses_;
}

void Counters::draw_queues(PacketBuffer& packets, Tracks& tracks,
                           const std::function<void()>& flush) {
  Arrival last;  // the one before; what happens at one time is one change
  std::int64_t depth = 0;
  std::int64_t drawn_depth = 0;
  const auto draw = [&] {
    if (depth == drawn_depth) return;
    auto& callback = callbacks_.at(last.callback);
    if (!callback.is_queue_known) return;
    packets.set_machine(callback.thread.host);
    if (callback.queue_track == 0) {
      callback.queue_track = track(packets, tracks, callback, "queue depth ", CounterUnit::count);
    }
    packets.count(last.time, callback.queue_track, depth);
    ++queue_changes_;
    drawn_depth = depth;
    flush();
  };
  arrivals_.drain([&](const Arrival& arrival) {
    const bool is_other = arrival.callback != last.callback;
    if (is_other || arrival.time != last.time) draw();
    if (is_other) depth = drawn_depth = 0;
    depth += arrival.change;
    last = arrival;
  });
  draw();
}

}  // namespace cie::viewer_export::perfetto
