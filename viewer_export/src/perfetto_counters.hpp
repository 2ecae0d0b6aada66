// The curves of each callback: response time, and how many messages wait for it.
#pragma once

#include "external_sorter.hpp"
#include "name_table.hpp"
#include "perfetto_packets.hpp"
#include "perfetto_tracks.hpp"
#include "recorded_run.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <tuple>
#include <unordered_map>

namespace cie::viewer_export::perfetto {

class Counters {
 public:
  Counters(std::size_t records_in_memory, const std::filesystem::path& spill_directory)
      : arrivals_(records_in_memory, spill_directory) {}

  // Throws WriteError.
  // `name`: its logical id.
  void see(const analysis::Instance& instance, std::string_view name);

  // At its end, the response time of an instance whose release is exact. After all were seen.
  void draw_response(PacketBuffer& packets, Tracks& tracks, const analysis::Instance& instance);
  // The queues of all callbacks that took messages and whose releases are all exact: messages that
  // have arrived and that no instance has taken yet, those left out that were overwritten.
  // `flush` is called after every change.
  void draw_queues(PacketBuffer& packets, Tracks& tracks, const std::function<void()>& flush);

  std::uint64_t responses() const noexcept { return responses_; }
  std::uint64_t queue_changes() const noexcept { return queue_changes_; }

 private:
  // One callback: where its curves belong, and what is known of it.
  struct Callback {
    ThreadKey thread;  // the first that ran it
    bool has_one_thread = true;
    bool is_queue_known = true;
    std::uint64_t response_track = 0;
    std::uint64_t queue_track = 0;
    std::uint32_t name = 0;
  };
  // A message arrived (1) or was taken (-1).
  struct Arrival {
    std::uint32_t callback = 0;
    std::int32_t change = 0;
    std::int64_t time = 0;
  };
  struct ByCallback {
    bool operator()(const Arrival& a, const Arrival& b) const {
      return std::tuple(a.callback, a.time, a.change) < std::tuple(b.callback, b.time, b.change);
    }
  };

  // A new one, of the callback's thread if it has but one, else of its process.
  std::uint64_t track(PacketBuffer& packets, Tracks& tracks, const Callback& callback,
                      std::string_view quantity, CounterUnit unit);

  std::unordered_map<std::uint32_t, Callback> callbacks_;  // by Instance::callback
  NameTable names_;
  ExternalSorter<Arrival, ByCallback> arrivals_;
  std::uint64_t responses_ = 0;
  std::uint64_t queue_changes_ = 0;
};

}  // namespace cie::viewer_export::perfetto
