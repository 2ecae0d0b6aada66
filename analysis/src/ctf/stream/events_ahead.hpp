// Events of a packet that were found before their turn.
#pragma once

#include <cie/analysis/event.hpp>

#include "event_cursor.hpp"
#include "vocabulary/tracer_clock.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace cie::analysis::ctf {

// One whose layout is fixed, by where and when it is after the one before it.
struct EventAhead {
  std::uint32_t after_ns;
  std::uint16_t distance;     // bytes between their contexts and fields
  std::uint16_t event_class;  // EventPlan::number
};
static_assert(sizeof(EventAhead) == 8);  // a packet may have a hundred thousand

// Those that follow on each other.
struct RunAhead {
  std::span<const EventAhead> events;  // behind them one more may be read
  Timestamp from{};                    // the first one is after that
  const std::uint8_t* data = nullptr;  // and after this
  Timestamp to{};                      // the last one
  std::uint32_t others = 0;            // between and behind them: they are only counted
  Timestamp last{};                    // of all

  Timestamp first_time() const noexcept { return from + Duration{events.front().after_ns}; }
};

// Takes events of a walk over them until there is no room, or one is before the last, or far behind it:
// those are told by whoever reads them.
class EventsAhead {
 public:
  struct Options {
    std::uint64_t frequency = 0;  // of the events' clock
    bool counts_others = false;   // those that tell nothing are counted
  };
  // `room` is borrowed. The walk begins at `data`; none is before `from`.
  EventsAhead(std::span<EventAhead> room, const std::uint8_t* data, Timestamp from,
              const Options& options) noexcept
      : next_(room.data()),
        end_(room.data() + room.size()),
        options_(options),
        body_(data),
        to_(from),
        last_(from),
        room_(room.data()),
        data_(data),
        from_(from) {}

  bool take(const EventCursor::Fixed& event) noexcept {
    const auto time = time_of_cycles(event.clock, options_.frequency);
    if (next_ == end_ || time < last_) return false;
    if (options_.counts_others && event.is_other) {
      ++others_;
      last_ = time;
      return true;
    }
    const auto after = static_cast<std::uint64_t>(time.ns) - static_cast<std::uint64_t>(to_.ns);
    const auto distance = static_cast<std::uint64_t>(event.body - body_);
    if (!std::in_range<std::uint32_t>(after) || !std::in_range<std::uint16_t>(distance)) {
      return false;
    }
    *next_++ = {.after_ns = static_cast<std::uint32_t>(after),
                .distance = static_cast<std::uint16_t>(distance),
                .event_class = event.event_class};
    body_ = event.body;
    to_ = last_ = time;
    return true;
  }

  bool is_any() const noexcept { return others_ > 0 || next_ != room_; }
  // What was taken.
  RunAhead run() const noexcept {
    return {.events = {room_, next_},
            .from = from_,
            .data = data_,
            .to = to_,
            .others = others_,
            .last = last_};
  }

 private:
  EventAhead* next_;
  EventAhead* end_;
  Options options_;
  const std::uint8_t* body_;  // of the last one in the room
  Timestamp to_;              // that
  Timestamp last_;            // of all
  std::uint32_t others_ = 0;
  EventAhead* room_;
  const std::uint8_t* data_;
  Timestamp from_;
};

}  // namespace cie::analysis::ctf
