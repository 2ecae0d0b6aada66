// One stream of a trace, from its files, as the steps that a merger puts in order of time.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/progress.hpp>

#include "ctf/metadata/file.hpp"
#include "ctf/program/late_fields.hpp"
#include "ctf/program/shown_fields.hpp"
#include "ctf/program/trace_plan.hpp"
#include "event_cursor.hpp"
#include "event_writer.hpp"
#include "events_ahead.hpp"
#include "lane.hpp"
#include "noted_events.hpp"
#include "packet_memory.hpp"
#include "packet_scanner.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace cie::analysis::ctf {

// A file of a stream. Rotation leaves several.
struct StreamFile {
  File file;
  std::shared_ptr<LateFields::OfTrace> trace;
  std::optional<Packet> first;  // empty: no packet can be found in it
};

// How a stream is known to the analyzer and to its merger.
struct StreamIdentity {
  StreamIndex index{};
  std::uint32_t channel = 0;
  std::uint32_t trace = 0;
  bool is_first_of_trace = false;
  std::int64_t merge_offset_ns = 0;  // added to its times to compare them with other streams'
  Progress* progress = nullptr;      // null: nobody looks
  bool is_idle = false;              // these two: see StreamBegin
  bool is_left_out = false;
  TimeWindow window{};         // nobody asks for events of packets outside it
  bool counts_others = false;  // see ReadOptions
};

// The sum, or the end of the time line that lies in its direction.
inline std::int64_t saturating_add(std::int64_t a, std::int64_t b) noexcept {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b < 0 ? std::numeric_limits<std::int64_t>::min()
               : std::numeric_limits<std::int64_t>::max();
}

class StreamReader {
 public:
  // `files` in order of time, at least one.
  StreamReader(std::vector<StreamFile> files, StreamIdentity identity);
  StreamReader(const StreamReader&) = delete;
  StreamReader& operator=(const StreamReader&) = delete;

  // Bytes of a packet like its first ones, and of the memory that holds one or several small ones.
  std::size_t packet_bytes() const noexcept;
  std::size_t memory_for_packets() const noexcept;
  // Finds the first step; comes before all others. With memory, which is borrowed, packets are held whole
  // and need not be read twice; null: without.
  void begin(PacketMemory* memory);
  void emit_begin(EventWriter& writer) const;
  // Where the next step stands on the time line of all streams; never goes back.
  std::int64_t key() const noexcept {
    return ahead_.events.empty() ? key_ : key_of(ahead_.first_time());
  }
  bool has_ended() const noexcept { return step_ == Step::ended; }
  // Emits the next step and finds the one after it. What moves in windows moves here. Requires that no
  // event is ahead.
  void step(EventWriter& writer);
  // The next steps as far as they are events that were found ahead: they are emitted without moving
  // anything. Whoever has emitted the last one finishes it.
  Lane lane() const noexcept;
  void finish_lane() noexcept;
  // One that was emitted tells nothing.
  void count_instead(EventBatch& batch) noexcept {
    if (!counts_others_) return;
    batch.take_back();
    ++counted_;
  }
  // Finds events ahead if there are any.
  bool look_ahead();
  // Finds the next step, whatever it is.
  void find_event();
  // Looks for the packet after a large one before its turn, which takes long. Moves nothing that events
  // are read from. False: there is nothing to do.
  bool scan_ahead();

  // Packets have a uuid from the first one on, and not their metadata's: that is told once, by
  // whoever begins the stream.
  bool is_all_foreign() const noexcept {
    return files_.front().first && files_.front().first->other_uuid.has_value();
  }
  std::uint64_t packets() const noexcept { return packets_; }
  const std::optional<Damage>& first_damage() const noexcept { return first_damage_; }
  const std::string& path() const noexcept { return files_.front().file.path(); }

  static constexpr std::size_t kSmallestPiece = 64U << 10U;  // bytes

 private:
  enum class Step : std::uint8_t { gap, packet_begin, event, packet_end, stream_end, ended };
  struct Gap {  // before a packet, or at the stream's end
    std::vector<Damage> damages;
    std::optional<std::uint64_t> discarded_events;
    std::optional<std::uint64_t> discarded_packets;
    std::optional<std::uint64_t> last_with_room;  // see Discarded; cycles
    std::optional<std::string> foreign;           // why the packet's metadata is not its own
    bool is_any() const noexcept {
      return !damages.empty() || discarded_events || discarded_packets || foreign;
    }
  };

  std::size_t held_bytes() const noexcept;  // of packets, at a time
  void load_packet();
  // What the scanner looks at is in the window then.
  template <typename Look>
  auto in_window(const Look& look) {
    scanner_->exchange(*window_);
    auto found = look();
    scanner_->exchange(*window_);
    return found;
  }
  void note_position(std::uint64_t position);
  bool is_new(const Packet& packet) const;
  bool take(const PacketScanner::Found& found);
  void note_damage(const Damage& damage);
  void count_losses(const PacketScanner::Found& found);
  void emit_event(EventWriter& writer);
  void emit_gap(EventWriter& writer);
  void emit_packet_begin(EventWriter& writer);
  void emit_packet_end(EventWriter& writer);
  void emit_counted(EventWriter& writer, Timestamp time);
  // An event of no thread.
  void emit(EventWriter& writer, Timestamp time, const EventBody& body) const;
  // Notes when something happens, and tells if that is before what happened last.
  void pass(EventWriter& writer, Timestamp time) {
    if (last_time_ && time < *last_time_) {
      emit(writer, time, TimeRegression{.previous = *last_time_});
    }
    last_time_ = time;
  }
  std::int64_t key_of(Timestamp time) const noexcept {
    return std::max(key_, saturating_add(time.ns, identity_.merge_offset_ns));
  }
  void stand_at(Timestamp time) noexcept { key_ = key_of(time); }
  Timestamp time_of(std::uint64_t cycles) const noexcept { return clock_.time_of(cycles); }
  std::string place_of(const Damage& damage) const;

  // The next events if they are of fixed layout and nobody noted them. Looking for several at a time
  // stays within one stream for a while: there it can be predicted what follows on what.
  static constexpr std::size_t kAhead = 16;
  EventsAhead::Options ahead_options() const noexcept {
    return {.frequency = clock_.frequency, .counts_others = counts_others_};
  }
  // Empty: there are none.
  std::optional<RunAhead> walk_ahead();
  // Whether the time line of all streams has its times as they are: neither does it end before, nor did
  // a wrong time lead the stream beyond them.
  bool is_on_time_line(const RunAhead& run) const noexcept;

  RunAhead ahead_{};
  LateFields::OfTrace* trace_ = nullptr;  // of the packet's file
  std::int64_t key_ = INT64_MIN;          // of the next step, or of one before those ahead
  ContextNumber<std::int32_t> cpu_;       // of the packet
  bool counts_others_;                    // as identity_ has it, but not of a snapshot
  std::uint64_t counted_ = 0;             // events of the packet that are only counted
  std::array<EventAhead, kAhead + 1> found_{};

  std::vector<StreamFile> files_;
  StreamIdentity identity_;
  ClockPlan clock_;
  bool has_times_ = false;
  bool has_packet_times_ = false;

  std::span<std::uint8_t> room_;
  std::size_t piece_ = kSmallestPiece;  // bytes to have in memory at a time
  std::size_t file_ = 0;                // of files_, being read
  std::size_t told_file_ = 0;           // whose packets were told last
  std::uint64_t position_ = 0;          // in it, as progress was told
  std::unique_ptr<PacketScanner> scanner_;
  std::optional<PacketScanner::Found> found_ahead_;
  NotedEvents noted_;             // of the packet
  std::optional<Window> window_;  // these three: for the events of the packet
  Frame frame_;
  std::vector<std::uint32_t> elements_;
  std::optional<EventCursor> cursor_;
  std::optional<Packet> packet_;
  std::uint64_t packet_last_clock_ = 0;
  bool is_outside_ = false;  // the packet, of the window: its events are passed over
  Gap gap_;
  Step step_ = Step::gap;
  ShownFields shown_;  // of the event that is read

  std::optional<Timestamp> last_end_;   // of the last packet
  std::optional<Timestamp> last_time_;  // of the last event or packet bound
  std::uint64_t clock_cycles_ = 0;
  std::optional<std::uint64_t> last_discarded_;
  std::optional<std::uint64_t> last_sequence_;
  std::size_t last_sequence_file_ = 0;
  struct Bounds {
    std::optional<std::uint64_t> begin;
    std::optional<std::uint64_t> end;
  };
  std::optional<Bounds> last_packet_;
  bool has_begun_ = false;  // without packet times: the one PacketBegin was sent
  std::uint64_t packets_ = 0;
  std::optional<Damage> first_damage_;
};

}  // namespace cie::analysis::ctf
