#include "perfetto_counters.hpp"

#include <cie/analysis/response_time.hpp>

#include <string>

namespace cie::viewer_export::perfetto {

using analysis::Instance;

void Counters::see(const Instance& instance) {
  const auto number = at(instance.callback);
  if (number >= callbacks_.size()) callbacks_.resize(number + 1);
  auto& callback = callbacks_[number];
  const auto thread = thread_of(instance);
  if (!callback.first_thread) callback.first_thread = thread;
  if (*callback.first_thread != thread) callback.has_one_thread = false;
  if (instance.writer_gid == 0) return;  // it took no message
  const bool is_exact = instance.release && is_known(instance.release_source) &&
                        instance.release->ns >= 0 && *instance.release <= instance.start;
  if (!is_exact) {
    callback.is_queue_known = false;
    return;
  }
  if (instance.release->ns < callback.last_release || instance.start.ns < callback.last_start) {
    callback.is_in_order = false;
  }
  callback.last_release = instance.release->ns;
  callback.last_start = instance.start.ns;
}

Counters::Callback& Counters::callback_of(const RecordedInstance& record) {
  auto& callback = callbacks_[at(record.instance.callback)];
  callback.name = record.name;
  callback.thread = record.thread;
  return callback;
}

std::uint64_t Counters::track(const Drawing& drawing, const Callback& callback,
                              std::string_view quantity, CounterUnit unit) {
  const auto& thread = *callback.first_thread;
  const auto parent = callback.has_one_thread
                          ? drawing.tracks.thread_track(callback.thread)
                          : drawing.tracks.process_track(thread.host, thread.pid);
  const auto uuid = drawing.tracks.new_uuid();
  drawing.packets.set_machine(thread.host);
  drawing.packets.counter_track(uuid, parent,
                                std::string(quantity) + drawing.names.at(callback.name), unit);
  return uuid;
}

std::optional<CounterValue> Counters::response(const Drawing& drawing,
                                               const RecordedInstance& record) {
  const auto& i = record.instance;
  const auto response = analysis::response_time(i);
  if (!response || !is_known(i.release_source)) return std::nullopt;
  auto& callback = callback_of(record);
  if (callback.response_track == 0) {
    callback.response_track = track(drawing, callback, "response time ", CounterUnit::time_ns);
  }
  ++responses_;
  return CounterValue{.track = callback.response_track, .value = response->ns};
}

void Counters::draw_queue(const Drawing& drawing, const RecordedInstance& record) {
  const auto& i = record.instance;
  if (i.writer_gid == 0) return;
  auto& callback = callback_of(record);
  if (!callback.is_queue_known) return;
  const auto add_arrival = [&](std::int64_t time, std::int32_t by) {
    arrivals_.add({.callback = i.callback, .change = by, .time = time});
  };
  auto& starts = callback.starts;
  if (!callback.is_in_order) {
    add_arrival(i.release->ns, 1);
    add_arrival(i.start.ns, -1);
    return;
  }
  for (; !starts.empty() && starts.front() < i.release->ns; starts.pop_front())
    change(drawing, callback, starts.front(), -1);
  change(drawing, callback, i.release->ns, 1);
  starts.push_back(i.start.ns);
  if (starts.size() > most_waiting_) {  // what is still to come is sorted from here on
    for (const auto start : starts)
      add_arrival(start, -1);
    starts.clear();
    callback.is_in_order = false;
  }
}

void Counters::change(const Drawing& drawing, Callback& callback, std::int64_t time,
                      std::int64_t by) {
  if (time != callback.changed_at) draw_depth(drawing, callback);
  callback.depth += by;
  callback.changed_at = time;
}

void Counters::draw_depth(const Drawing& drawing, Callback& callback) {
  if (callback.depth == callback.drawn_depth) return;
  if (callback.queue_track == 0) {
    callback.queue_track = track(drawing, callback, "queue depth ", CounterUnit::count);
  }
  drawing.packets.set_machine(callback.first_thread->host);
  drawing.packets.count(callback.changed_at,
                        {.track = callback.queue_track, .value = callback.depth});
  callback.drawn_depth = callback.depth;
  ++queue_changes_;
}

}  // namespace cie::viewer_export::perfetto
