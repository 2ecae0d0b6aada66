// One stream of a trace, from its files, as the steps that a merger puts in order of time.
#pragma once

#include <cie/analysis/event.hpp>

#include "event_cursor.hpp"
#include "file.hpp"
#include "packet_scanner.hpp"
#include "trace_plan.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace cie::analysis::ctf {

// Receives events in order of time; what they view is valid during the call.
using EventSink = std::function<void(const Event&)>;

// A file of a stream. Rotation leaves several.
struct StreamFile {
  File file;
  std::shared_ptr<const TracePlan> trace;
  std::optional<Packet> first;  // empty: no packet can be found in it
};

// How a stream is known to the analyzer and to its merger.
struct StreamIdentity {
  StreamIndex index{};
  std::uint32_t channel = 0;
  std::int64_t merge_offset_ns = 0;  // added to its times to compare them with other streams'
  std::size_t piece = 0;             // bytes to have in memory at a time
};

class StreamReader {
 public:
  // `files` in order of time, at least one; `state` is shared by the streams of a trace, borrowed.
  StreamReader(std::vector<StreamFile> files, StreamIdentity identity, VocabularyState& state);

  void emit_begin(const EventSink& sink, Event& event) const;
  // Where the next step stands on the time line of all streams; never goes back.
  std::int64_t key() const noexcept { return key_; }
  bool has_ended() const noexcept { return step_ == Step::ended; }
  // Emits the next step and finds the one after it.
  void advance(const EventSink& sink, Event& event);

  std::uint64_t packets() const noexcept { return packets_; }
  const std::optional<Damage>& first_damage() const noexcept { return first_damage_; }

 private:
  enum class Step : std::uint8_t { gap, packet_begin, event, packet_end, stream_end, ended };
  struct Gap {  // before a packet, or at the stream's end
    std::vector<Damage> damages;
    std::optional<std::uint64_t> discarded_events;
    std::optional<std::uint64_t> discarded_packets;
    bool is_any() const noexcept {
      return !damages.empty() || discarded_events || discarded_packets;
    }
  };

  void load_packet();
  bool take(const PacketScanner::Found& found);
  void note_damage(const Damage& damage);
  void count_losses();
  void find_event();
  void emit_gap(const EventSink& sink, Event& event);
  void emit_packet_begin(const EventSink& sink, Event& event);
  void emit_event(const EventSink& sink, Event& event);
  void emit_packet_end(const EventSink& sink, Event& event);
  void check_time(const EventSink& sink, Event& event, Timestamp time);
  void head(Event& event, Timestamp time) const noexcept;
  void stand_at(Timestamp time) noexcept;
  Timestamp time_of(std::uint64_t cycles) const noexcept { return clock_.time_of(cycles); }
  std::string place_of(const Damage& damage) const;

  std::vector<StreamFile> files_;
  StreamIdentity identity_;
  VocabularyState& state_;
  ClockPlan clock_;
  bool has_times_ = false;
  bool has_packet_times_ = false;

  std::size_t file_ = 0;  // of files_, being read
  std::unique_ptr<PacketScanner> scanner_;
  std::optional<EventCursor> cursor_;
  std::optional<Packet> packet_;
  std::uint64_t packet_last_clock_ = 0;
  Gap gap_;
  Step step_ = Step::gap;
  std::int64_t key_ = INT64_MIN;

  std::optional<Timestamp> last_end_;   // of the last packet
  std::optional<Timestamp> last_time_;  // of the last event or packet bound
  std::uint64_t clock_cycles_ = 0;
  std::optional<std::uint64_t> last_discarded_;
  std::optional<std::uint64_t> last_sequence_;
  std::size_t last_sequence_file_ = 0;
  bool has_begun_ = false;  // without packet times: the one PacketBegin was sent
  std::uint64_t packets_ = 0;
  std::optional<Damage> first_damage_;
};

}  // namespace cie::analysis::ctf
