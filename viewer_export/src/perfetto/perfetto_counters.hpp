// The curves of each callback: response time, and how many messages wait for it.
#pragma once

#include "output/external_sorter.hpp"
#include "perfetto_packets.hpp"
#include "perfetto_tracks.hpp"
#include "timelines/recorded_items.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace cie::viewer_export::perfetto {

// What curves are drawn with. Borrowed.
struct Drawing {
  PacketBuffer& packets;
  Tracks& tracks;
  const std::vector<std::string>& names;  // of callbacks, by RecordedInstance::name
};

class Counters {
 public:
  // Keeps `records_in_memory` arrivals that it has to sort, and as many messages per callback that
  // wait.
  Counters(std::size_t records_in_memory, const std::filesystem::path& spill_directory)
      : most_waiting_(records_in_memory), arrivals_(records_in_memory, spill_directory) {}

  // Every instance, in order of arrival.
  void see(const analysis::Instance& instance);

  // After all were seen, in order of start: the response time to be drawn at the instance's end, if
  // its release is exact.
  std::optional<CounterValue> response(const Drawing& drawing, const RecordedInstance& record);
  // Likewise: the queue of a callback that takes messages and whose releases are all exact, that
  // is, messages that have arrived and that no instance has taken yet, those left out that were
  // overwritten. Throws WriteError.
  void draw_queue(const Drawing& drawing, const RecordedInstance& record);
  // Draws what is left. `flush` is called again and again.
  template <typename Flush>
  void finish(const Drawing& drawing, const Flush& flush);

  std::uint64_t responses() const noexcept { return responses_; }
  std::uint64_t queue_changes() const noexcept { return queue_changes_; }

 private:
  // One callback: where its curves belong, and what is known of it.
  struct Callback {
    std::optional<ThreadKey> first_thread;  // that ran it
    bool has_one_thread = true;
    bool is_queue_known = true;
    bool is_in_order = true;  // its messages are taken in the order in which they arrive
    std::int64_t last_release = 0;
    std::int64_t last_start = 0;
    std::uint32_t name = 0;
    std::uint32_t thread = 0;
    std::uint64_t response_track = 0;
    std::uint64_t queue_track = 0;
    // The queue, and when what has changed since it was drawn did so.
    std::int64_t depth = 0;
    std::int64_t drawn_depth = 0;
    std::int64_t changed_at = 0;
    std::deque<std::int64_t> starts;  // when messages that have arrived are taken
  };
  // A message arrived (1) or was taken (-1).
  struct Arrival {
    analysis::CallbackIndex callback{};
    std::int32_t change = 0;
    std::int64_t time = 0;
  };
  struct ByCallback {
    bool operator()(const Arrival& a, const Arrival& b) const {
      return std::tuple(a.callback, a.time, a.change) < std::tuple(b.callback, b.time, b.change);
    }
  };

  // A new one, of the callback's thread if it has but one, else of its process.
  static std::uint64_t track(const Drawing& drawing, const Callback& callback,
                             std::string_view quantity, CounterUnit unit);
  Callback& callback_of(const RecordedInstance& record);
  // In order of time; what happens at one time is one change.
  void change(const Drawing& drawing, Callback& callback, std::int64_t time, std::int64_t by);
  void draw_depth(const Drawing& drawing, Callback& callback);

  std::size_t most_waiting_;
  std::vector<Callback> callbacks_;               // by Instance::callback
  ExternalSorter<Arrival, ByCallback> arrivals_;  // of callbacks that are not in order
  std::uint64_t responses_ = 0;
  std::uint64_t queue_changes_ = 0;
};

template <typename Flush>
void Counters::finish(const Drawing& drawing, const Flush& flush) {
  arrivals_.drain([&](const Arrival& arrival) {
    change(drawing, callbacks_[at(arrival.callback)], arrival.time, arrival.change);
    flush();
  });
  for (auto& callback : callbacks_) {
    for (const auto start : callback.starts)
      change(drawing, callback, start, -1);
    callback.starts.clear();
    draw_depth(drawing, callback);
    flush();
  }
}

}  // namespace cie::viewer_export::perfetto
