// Events that outlive the buffers they were read from.
#pragma once

#include <cie/analysis/event.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <variant>

namespace cie::analysis {

// Kinds of events as bits, by their index in EventBody.
template <typename... Bodies>
constexpr std::uint64_t kinds() noexcept {
  static_assert(std::variant_size_v<EventBody> <= 64);
  return (... | (std::uint64_t{1} << EventBody(Bodies{}).index()));
}

// Events that view memory that is not their own.
inline constexpr std::uint64_t kWithViews =
    kinds<StreamBegin, DamagedPacket, RunBegin, NodeInit, CallbackInit, PublisherInit, ThreadInit,
          ThreadSched, SchedSwitch, SchedProcessFork, ProcessName, OtherEvent, Untranslated>();

// Keeps a bounded number of events with copies of what they view. Used again after clear(), so that
// it allocates little after its first round.
class EventBatch {
 public:
  explicit EventBatch(std::size_t capacity);
  EventBatch(const EventBatch&) = delete;
  EventBatch& operator=(const EventBatch&) = delete;

  bool is_full() const noexcept { return next_ == end_; }
  // Makes room for an event, which holds what another one left. Requires that it is not full.
  Event& add() noexcept { return *next_++; }
  // Once an event of the batch is complete: has it view copies of what it views.
  void keep(Event& event) {
    if ((kWithViews >> event.body.index() & 1U) != 0) keep_views(event.body);
  }
  void clear() noexcept;
  // Calls `consume` with each. Meanwhile the next ones are on their way from the other core's
  // cache.
  template <typename Consume>
  void each(const Consume& consume) const {
    constexpr std::ptrdiff_t kAhead = 4;
    constexpr std::ptrdiff_t kCacheLine = 64;
    for (const Event* event = events_.get(); event != next_; ++event) {
      const auto* line = reinterpret_cast<const char*>(event + kAhead);
      for (std::ptrdiff_t at = 0; at < static_cast<std::ptrdiff_t>(sizeof(Event)); at += kCacheLine)
        __builtin_prefetch(line + at);
      consume(*event);
    }
  }
  // Valid until the next clear().
  std::span<const Event> events() const noexcept { return {events_.get(), next_}; }

 private:
  void keep_views(EventBody& body);

  std::unique_ptr<Event[]> events_;  // NOLINT(modernize-avoid-c-arrays): what it owns is one
  Event* next_;
  Event* end_;
  std::pmr::monotonic_buffer_resource memory_;  // what the events view
};

}  // namespace cie::analysis
