#include "noted_events.hpp"

#include "vocabulary/tracer_clock.hpp"

#include <new>

namespace cie::analysis::ctf {

void NotedEvents::set_room(std::span<std::uint8_t> room) noexcept {
  const auto count = room.size() / sizeof(EventAhead);
  room_ = {};
  if (count > 1) room_ = {new (room.data()) EventAhead[count], count - 1};
}

void NotedEvents::begin(const Packet& packet, const Window& window) {
  clear();
  used_ = 0;
  is_noting_ = packet.stream->has_packet_times && packet.begin &&
               window.holds(packet.offset, (packet.content_end + 7) / 8);
  window_version_ = window.version();
}

bool NotedEvents::walk(EventCursor& cursor) {
  if (!is_noting_ || used_ == room_.size()) return false;
  const auto begin = cursor.place();
  EventsAhead events(room_.subspan(used_), cursor.next_event(),
                     time_of_cycles(begin.clock, options_.frequency), options_);
  cursor.walk_fixed([&events](const EventCursor::Fixed& event) { return events.take(event); });
  const auto run = events.run();
  if (run.events.size() + run.others >= kFewest) {
    runs_.push_back({.begin = begin, .end = cursor.place(), .events = run});
    used_ += run.events.size();
  }
  return true;
}

std::optional<RunAhead> NotedEvents::pass(EventCursor& cursor, const Window& window) noexcept {
  if (window.version() != window_version_) return std::nullopt;
  const auto place = cursor.place();
  while (next_ < runs_.size() && runs_[next_].begin.at < place.at)
    ++next_;
  if (next_ == runs_.size() || runs_[next_].begin != place) return std::nullopt;
  const auto& run = runs_[next_++];
  cursor.go_on_at(run.end);
  return run.events;
}

}  // namespace cie::analysis::ctf
