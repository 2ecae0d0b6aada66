// The events of a packet as whoever looked whether all of them can be read has found them.
#pragma once

#include <cie/analysis/time.hpp>

#include "event_cursor.hpp"
#include "events_ahead.hpp"
#include "packet.hpp"
#include "window.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace cie::analysis::ctf {

// Those of fixed layout need not be looked for again as long as the window holds the packet whole: to
// walk from one to the next is one long chain of loads.
class NotedEvents {
 public:
  explicit NotedEvents(const EventsAhead::Options& options) noexcept : options_(options) {}

  // Bytes of memory that the events of most packets of a size need, and to have such; borrowed.
  static constexpr std::size_t room_for(std::size_t packet_bytes) noexcept {
    return packet_bytes / kBytesPerEvent * sizeof(EventAhead);
  }
  void set_room(std::span<std::uint8_t> room) noexcept;

  void clear() noexcept {
    runs_.clear();
    next_ = 0;
    is_noting_ = false;
  }
  // For a packet that a window was asked to show. What it does not hold whole is not noted.
  void begin(const Packet& packet, const Window& window);
  // Walks with a cursor at the packet's next event as long as it finds what can be noted. False: that is
  // nothing more of this packet.
  bool walk(EventCursor& cursor);
  // Moves a cursor of the same packet over those that begin where it stands. Empty: none do.
  std::optional<RunAhead> pass(EventCursor& cursor, const Window& window) noexcept;

 private:
  // Few packets have more events than one for so many of their bytes. Others are looked for again.
  static constexpr std::size_t kBytesPerEvent = 32;
  static constexpr std::size_t kFewest = 16;  // of a run; to look for fewer again costs no more

  EventsAhead::Options options_;
  std::span<EventAhead> room_;  // but for the last one, which may be read
  std::size_t used_ = 0;
  struct Run {
    EventCursor::Place begin;
    EventCursor::Place end;
    RunAhead events;
  };
  std::vector<Run> runs_;
  std::size_t next_ = 0;  // of the runs
  bool is_noting_ = false;
  std::uint64_t window_version_ = 0;
};

}  // namespace cie::analysis::ctf
