// Walks over the events of one packet.
#pragma once

#include "base/prefetch.hpp"
#include "ctf/program/program.hpp"
#include "packet.hpp"
#include "window.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace cie::analysis::ctf {

// A clock's next value from so many of its low bits alone.
inline std::uint64_t extend_clock(std::uint64_t last, std::uint64_t value,
                                  std::uint32_t bits) noexcept {
  if (bits >= 64) return value;
  return extend_clock_by(last, value, (std::uint64_t{1} << bits) - 1);
}

class EventCursor {
 public:
  // Borrowed. Registers of `frame` hold what the packet's header and context left there.
  EventCursor(Window& window, Frame& frame) : window_(&window), frame_(&frame) {}

  // `clock`: cycles that the stream's clock showed last, for packets without a begin.
  void begin(const Packet& packet, std::uint64_t clock);

  // An event all of which lies at fixed places.
  struct Fixed {
    std::uint16_t event_class = 0;       // EventPlan::number
    bool is_other = false;               // see EventPlan
    const std::uint8_t* body = nullptr;  // contexts and fields
    std::uint64_t clock = 0;             // cycles
  };
  // Goes over such events as long as there are some and `take(event)` wants them. Nothing in the
  // window moves meanwhile.
  template <typename Take>
  void walk_fixed(const Take& take);
  // Where the walk stands. A cursor at the begin of the same packet may go on there, if the window has
  // that as before.
  struct Place {
    std::uint64_t at = 0;  // bits of the window's data
    std::uint64_t clock = 0;
    friend bool operator==(const Place&, const Place&) = default;
  };
  Place place() const noexcept { return {.at = bits_.at, .clock = clock_}; }
  void go_on_at(const Place& place) noexcept {
    bits_.at = place.at;
    clock_ = place.clock;
  }
  // Other streams have their turn before this one is read on: by then it is in the cache.
  void prefetch() const noexcept {
    constexpr std::size_t kLines = 8;
    for (std::size_t line = 0; line < kLines; ++line)
      prefetch_line<Access::read>(next_event() + line * kCacheLine);
  }

  enum class Step : std::uint8_t { event, end, damaged };
  // Reads the next event's header, of whatever kind. After `event` comes read_body().
  Step next();
  // Finds the context's values and those that the event's translation asks for. False: damaged.
  bool read_body();
  // The same, and what the event shows of itself.
  bool read_body(ShownFields& shown);

  const EventPlan& plan() const noexcept { return *plan_; }
  std::uint64_t clock() const noexcept { return clock_; }  // cycles, of the event read last
  // After read_body().
  std::optional<std::int64_t> context(ContextSlot which) const noexcept {
    return Payload(context_.data()).integer(slot(which));
  }
  Payload payload() const noexcept { return Payload(fields_.data()); }

  // The next event, as the window has it.
  const std::uint8_t* next_event() const noexcept { return bits_.data + bits_.at / 8; }
  // Bits of the packet before the contexts and fields of an event that is being walked over.
  std::uint64_t position_of(const Fixed& event) const noexcept {
    return (base_ + static_cast<std::uint64_t>(event.body - bits_.data)) * 8;
  }
  // After `damaged`: why, and where in the packet.
  std::string reason() const;
  std::uint64_t position() const noexcept { return base_ * 8 + bits_.at; }
  // Bits of the packet before the event that next() looked at last.
  std::uint64_t event_begin() const noexcept { return event_begin_; }

 private:
  // `read` finds an event's header from where it begins and the clock before it.
  template <typename Read, typename Take>
  void walk_fixed(const Read& read, const Take& take);
  bool read_fixed_header(const HeaderLayout& layout, std::uint64_t& id);
  Outcome run_here(const Sequence& program, Field* fields);
  bool extend(std::uint64_t at);
  bool is_good(Outcome outcome);
  bool read_fields();
  Step fail(const char* reason);

  Window* window_;
  Frame* frame_;
  const Packet* packet_ = nullptr;
  const EventPlan* plan_ = nullptr;
  Bits bits_;
  std::uint64_t base_ = 0;  // bytes of the packet before bits_.data
  std::uint64_t clock_ = 0;
  std::uint64_t event_begin_ = 0;
  std::optional<std::uint64_t> unknown_id_;
  const char* reason_ = "";
  std::array<Field, 2> header_{};
  std::array<Field, kContextSlots> context_{};
  std::array<Field, kMaxSlots> fields_{};
  std::array<char, 32> name_{};  // of the thread, where it is asked for
};

template <typename Take>
void EventCursor::walk_fixed(const Take& take) {
  const auto& layout = packet_->stream->header_layout;
  if (!layout || bits_.at % 8 != 0) return;
  switch (layout->shape) {
    case HeaderLayout::Shape::compact:
      walk_fixed(CompactHeader::read, take);
      break;
    case HeaderLayout::Shape::large:
      walk_fixed(LargeHeader::read, take);
      break;
    case HeaderLayout::Shape::other:
      // An id that no event has ends the walk.
      walk_fixed(
          [&layout](const std::uint8_t* begin, std::uint64_t last) {
            return layout->read(begin, last).value_or(EventHeader{.id = ~std::uint64_t{0}});
          },
          take);
      break;
  }
}

// What changes stays in registers.
template <typename Read, typename Take>
[[gnu::always_inline]] inline void EventCursor::walk_fixed(const Read& read, const Take& take) {
  const auto& stream = *packet_->stream;
  const auto size = bits_.end / 8;
  if (size == 0 || size + Window::kReadable < stream.most_fixed_bytes()) return;
  const auto events = stream.fixed_events();
  const auto* const end = bits_.data + size;
  // The last place where any event may be read, though it may reach beyond the end.
  const auto* const last = std::min(end - 1, end + Window::kReadable - stream.most_fixed_bytes());
  const auto* begin = bits_.data + bits_.at / 8;
  auto clock = clock_;
  while (begin <= last) {
    const auto header = read(begin, clock);
    if (header.id >= events.size()) [[unlikely]]
      break;
    const auto& event = events[header.id];
    const auto* body = begin + header.bytes;
    const auto* const next = body + event.bytes;
    if (next > end) [[unlikely]]
      break;
    if (!take(Fixed{.event_class = event.event_class,
                    .is_other = event.is_other,
                    .body = body,
                    .clock = header.clock})) {
      break;
    }
    clock = header.clock;
    begin = next;
  }
  bits_.at = static_cast<std::uint64_t>(begin - bits_.data) * 8;
  clock_ = clock;
}

}  // namespace cie::analysis::ctf
