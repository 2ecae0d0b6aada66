// Finds the good packets of one stream file, and what is damaged between them.
#pragma once

#include <cie/analysis/time.hpp>

#include "event_cursor.hpp"
#include "noted_events.hpp"
#include "packet.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis::ctf {

class PacketScanner {
 public:
  static constexpr std::size_t kHeaderPiece = 4096;  // bytes that hold most headers
  // Borrowed. `piece`: bytes to have in memory at a time.
  // Packets outside `window` are taken by their headers, whatever they hold.
  PacketScanner(const File& file, const TracePlan& trace, std::size_t piece,
                const TimeWindow& window = {});
  PacketScanner(const PacketScanner&) = delete;
  PacketScanner& operator=(const PacketScanner&) = delete;

  // What comes next: damage (one or more bad packets in a row), then a packet whose events can all
  // be read. Without a packet the file ends.
  struct Found {
    std::optional<Damage> damage;
    std::optional<Packet> packet;
    std::uint64_t last_clock = 0;  // of its last event, or its begin
    bool is_outside = false;       // of the window: nobody looked at its events
  };
  // `noted`: where to note those of the packet found; null: nowhere.
  Found next(NotedEvents* noted = nullptr);
  // The next packet by its header alone, whatever it holds. A scanner does either this or the
  // above.
  std::optional<Packet> next_header();
  // For the packet that next_header() gave: whether events follow its header, and the clock at its
  // last event if all of them can be read.
  bool has_events(const Packet& packet);
  std::optional<std::uint64_t> last_clock(const Packet& packet);

  // For the packet found last, before it is read: the clock at the last event behind whose header it
  // had kRoom left, more than most events take. Empty: it has that in the end, or nobody looked at
  // its events. Tracers that discard events do so only when a packet has no room for them.
  std::optional<std::uint64_t> last_clock_with_room(const Found& found);
  static constexpr std::uint64_t kRoom = 1024;  // bytes

  // Of this file. Packets are looked for in the scanner's own; who lends it another one has in that
  // what was looked at.
  void exchange(Window& window) noexcept { std::swap(window_, window); }
  // For the packet found last: what its header and context left for its events.
  const Registers& registers() const noexcept { return frame_.registers; }

 private:
  // Where a header is read: looking ahead must not disturb the packet that is being read.
  struct Place {
    Window& window;
    Frame& frame;
  };
  // Empty: `reason_` says why.
  std::optional<Packet> header_at(std::uint64_t offset, Place place);
  std::optional<Packet> header_at(std::uint64_t offset) {
    return header_at(offset, {window_, frame_});
  }
  // The same, of whatever uuid. One that is not known yet must be followed by another packet of it,
  // or by the file's end; from then on it is known.
  std::optional<Packet> packet_at(std::uint64_t offset);
  std::optional<Packet> packet_of_other_uuid(std::uint64_t offset);
  bool is_packet_ahead(std::uint64_t offset);
  std::optional<std::uint64_t> packet_within(const Packet& packet);
  bool read_header(std::uint64_t offset, const Sequence* program, Field* fields, Bits& bits,
                   Place place);
  const StreamPlan* stream_of(const Field* header);
  std::optional<Packet> describe(std::uint64_t offset, const StreamPlan& stream,
                                 const Field* header, const Field* context, std::uint64_t at);
  // Than those before it in a stream that has one.
  bool is_of_other_cpu(const Packet& packet);
  bool is_outside(const Packet& packet) const;
  bool is_mostly_hole(const Packet& packet);
  bool has_readable_events(const Packet& packet, std::uint64_t& last_clock,
                           NotedEvents* noted = nullptr);
  void cut(Packet& packet);
  std::uint64_t find_magic(std::uint64_t from, Window& window);
  std::uint64_t after_bad_content(const Packet& packet);

  const TracePlan& trace_;
  TimeWindow time_window_;
  Window window_;
  Window ahead_;
  std::vector<std::uint32_t> elements_;
  Frame frame_;
  Frame ahead_frame_;
  std::optional<Packet> packet_ahead_;  // the one that was looked for last, if there is any
  EventCursor probe_;
  std::optional<Damage> rest_;  // behind the packet found last
  std::uint64_t offset_ = 0;
  std::uint64_t examined_ = 0;  // bytes of content looked at, to bound looking again
  std::uint64_t holes_ = 0;     // bytes of holes in them
  std::optional<std::int32_t> cpu_;
  // What packets have instead of the metadata's uuid, as the last one that was taken for a packet
  // shows; and whether a packet was refused for its uuid alone.
  std::optional<Uuid> other_uuid_;
  bool is_any_uuid_good_ = false;
  bool has_unknown_uuid_ = false;
  std::string reason_;
};

}  // namespace cie::analysis::ctf
