// A stream's events that were found ahead, as a merger takes them.
#pragma once

#include <cie/analysis/event.hpp>

#include "base/prefetch.hpp"
#include "ctf/program/late_fields.hpp"
#include "event_writer.hpp"
#include "events_ahead.hpp"

#include <cstddef>
#include <cstdint>

namespace cie::analysis::ctf {

// All that is touched of a stream for each of them, in one cache line: streams take turns, and lines of
// all of them stay in the cache if they are few.
class alignas(kCacheLine) Lane {
 public:
  // Without any.
  Lane() noexcept = default;
  // Of a packet. Requires an event.
  Lane(const RunAhead& run, std::int64_t merge_offset_ns, LateFields::OfTrace& trace,
       StreamIndex index, ContextNumber<std::int32_t> cpu) noexcept
      : next_(&run.events.front()),
        last_(&run.events.back()),
        body_(run.data + next_->distance),
        time_(run.first_time()),
        merge_offset_ns_(merge_offset_ns),
        trace_(&trace),
        index_(index),
        cpu_(cpu) {}

  bool has_next() const noexcept { return next_ != nullptr; }
  bool has_another() const noexcept { return next_ != last_; }  // behind the next one
  // Where the one behind the next one stands on the time line of all streams; anywhere if there is
  // none.
  std::int64_t key_after() const noexcept {
    return detail::wrapping_add(detail::wrapping_add(time_.ns, next_[1].after_ns),
                                merge_offset_ns_);
  }
  // Emits the next one, and stays there. False: it tells nothing, see Translator.
  [[gnu::always_inline]] bool emit(EventWriter& writer) const {
    prefetch_line<Access::read>(body_ + kBytesAhead);
    prefetch_line<Access::read>(next_ + kEventsAhead);
    auto& event = writer.add();
    event.head.time = time_;
    event.head.stream = index_;
    event.head.cpu = cpu_;
    return trace_->add(next_->event_class, event, body_, writer.batch());
  }
  void go_on() noexcept {
    ++next_;
    body_ += next_->distance;
    time_.ns += next_->after_ns;
  }

 private:
  // What comes to the cache meanwhile: of bodies, and of those in the lane.
  static constexpr std::size_t kBytesAhead = 512;
  static constexpr std::size_t kEventsAhead = 24;

  const EventAhead* next_ = nullptr;    // whose turn comes
  const EventAhead* last_ = nullptr;    // of them
  const std::uint8_t* body_ = nullptr;  // of the next one, and when it was
  Timestamp time_{};
  std::int64_t merge_offset_ns_ = 0;
  LateFields::OfTrace* trace_ = nullptr;
  StreamIndex index_{};
  ContextNumber<std::int32_t> cpu_{};  // of the packet
};

}  // namespace cie::analysis::ctf
