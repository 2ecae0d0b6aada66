// Events of a packet that were found before their turn.
#pragma once

#include <cie/analysis/event.hpp>

#include "event_cursor.hpp"
#include "vocabulary/tracer_clock.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace cie::analysis::ctf {

// One whose layout is fixed, and where the window has it.
struct EventAhead {
  const EventPlan* plan = nullptr;
  const std::uint8_t* body = nullptr;
  Timestamp time;
};

// Takes events of a walk over them until there is no room, or one is before the last: what runs
// backwards is told by whoever reads it.
class EventsAhead {
 public:
  // `room` is borrowed. `frequency`: of the clock of the events. `counts_others`: those that tell nothing
  // are counted.
  EventsAhead(std::span<EventAhead> room, std::uint64_t frequency, bool counts_others) noexcept
      : begin_(room.data()),
        end_(room.data() + room.size()),
        next_(room.data()),
        frequency_(frequency),
        counts_others_(counts_others) {}

  // From an empty room on. What follows is at `last` or later.
  void restart(Timestamp last) noexcept {
    next_ = begin_;
    others_ = 0;
    last_ = last;
  }
  bool take(const EventCursor::Fixed& event) noexcept {
    const auto time = time_of_cycles(event.clock, frequency_);
    if (next_ == end_ || time < last_) return false;
    last_ = time;
    if (counts_others_ && event.is_other) {
      ++others_;
      return true;
    }
    *next_++ = {.plan = event.plan, .body = event.body, .time = time};
    return true;
  }

  bool is_any() const noexcept { return others_ > 0 || next_ != begin_; }
  std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(next_ - begin_); }
  std::uint64_t others() const noexcept { return others_; }
  Timestamp last() const noexcept { return last_; }
  Timestamp time_of(std::uint64_t cycles) const noexcept {
    return time_of_cycles(cycles, frequency_);
  }

 private:
  EventAhead* begin_;
  EventAhead* end_;
  EventAhead* next_;
  std::uint64_t frequency_;
  std::uint64_t others_ = 0;
  Timestamp last_{};
  bool counts_others_;
};

}  // namespace cie::analysis::ctf
