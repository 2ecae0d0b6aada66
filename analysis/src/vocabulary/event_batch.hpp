// Events that outlive the buffers they were read from, and those that follow from them.
#pragma once

#include <cie/analysis/event.hpp>

#include "base/prefetch.hpp"
#include "field.hpp"
#include "vocabulary.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace cie::analysis {

// Kinds of events as bits, by their index in EventBody.
template <typename... Bodies>
constexpr std::uint64_t kinds() noexcept {
  static_assert(std::variant_size_v<EventBody> <= 64);
  return (... | (std::uint64_t{1} << EventBody(Bodies{}).index()));
}

// Events that view memory that is not their own.
inline constexpr std::uint64_t kWithViews =
    kinds<StreamBegin, PacketBegin, DamagedPacket, RunBegin, NodeInit, CallbackInit, PublisherInit,
          ThreadInit, ThreadSched, ForeignCallback, Ros2Tracer, UntracedEntity, UntracedWriter,
          ProcessName, OtherEvent>();

// Keeps a bounded number of events with copies of what they view, and of shown fields no more than
// one event above kMostShown bytes. Used again after clear(), so that
// it allocates little after its first round.
class EventBatch {
 public:
  static constexpr std::size_t kMostShown = std::size_t{1} << 20U;
  explicit EventBatch(std::size_t capacity);
  EventBatch(const EventBatch&) = delete;
  EventBatch& operator=(const EventBatch&) = delete;

  bool is_full() const noexcept { return next_ == end_; }
  // Makes room for an event, which holds what another one left but that it is of the trace. Requires
  // that it is not full.
  Event& add() noexcept {
    next_->head.is_derived = false;
    next_->head.stands_for_cause = false;
    return *next_++;
  }
  // The one before it, if nothing follows from that; null: there is none.
  Event* before(const Event& event) noexcept {
    if (&event == events_.get()) return nullptr;
    auto* const earlier = events_.get() + (&event - events_.get() - 1);
    return derived_.empty() || derived_.back().cause != earlier ? earlier : nullptr;
  }
  // Whether it means nothing itself and nothing follows from it. Of the event that was added last.
  bool is_silent(const Event& event) const noexcept {
    return std::holds_alternative<OtherEvent>(event.body) &&
           (derived_.empty() || derived_.back().cause != &event);
  }
  // Forgets the event that was added last, from which nothing follows.
  void take_back() noexcept { new_ = --next_; }
  // Once an event of the batch is complete: has it view copies of what it views.
  void keep(Event& event) {
    const auto kind = std::uint64_t{1} << event.body.index();
    kinds_ |= kind;
    if ((kWithViews & kind) != 0) keep_views(event.body);
  }
  // Completes an event of the batch that has its head. If the meaning depends on earlier events, it
  // becomes an OtherEvent.
  void translate(Event& event, const Translation& translation, const Payload& payload,
                 VocabularyState& state) {
    if (translation.translate == nullptr) {
      leave_other(event, translation);
    } else {
      translation.translate(payload, state, event.body);
      keep(event);
    }
  }
  // Makes it an OtherEvent of that name, which lives as long as its vocabulary.
  static void leave_other(Event& event, const Translation& translation) {
    event.body.emplace<OtherEvent>(OtherEvent{.name = translation.event});
  }

  // Which kinds of events were kept, as bits.
  std::uint64_t kinds_kept() const noexcept { return kinds_; }
  // Events that were added since the last call: whoever derives from them sees each once.
  std::span<Event> take_new() noexcept { return {std::exchange(new_, next_), next_}; }
  // Those of them before this one of the batch, which counts as seen.
  std::span<Event> take_new_before(Event& event) noexcept {
    return {std::exchange(new_, &event + 1), &event};
  }
  // Adds an event that follows from `cause`, one of the batch's, to be consumed right after it;
  // null: after them all. Causes come in their order.
  template <typename Body>
  void derive(const Event* cause, const EventHead& head, const Body& body) {
    auto& [of, event] = derived_.emplace_back();
    of = cause;
    event.head = head;
    event.head.is_derived = true;
    event.head.stands_for_cause = false;
    event.body.emplace<Body>(body);
    keep(event);
  }
  // The same for an event that means one thing and has no views: its place is taken by that, if
  // nothing was derived from it before, which would have to come first.
  // Returns it to be filled in: a copy of what was just written in parts waits until all of it has
  // reached the cache.
  template <typename Body>
  Body& derive_instead(const Event* cause, const EventHead& head) {
    static_assert((kWithViews & kinds<Body>()) == 0);
    if (cause == nullptr || (!derived_.empty() && derived_.back().cause == cause)) {
      derive(cause, head, Body{});
      return std::get<Body>(derived_.back().event.body);
    }
    auto& event = events_[static_cast<std::size_t>(cause - events_.get())];
    event.head.is_derived = true;
    event.head.stands_for_cause = true;
    kinds_ |= kinds<Body>();
    return event.body.template emplace<Body>();
  }

  void clear() noexcept;
  // Calls `consume` with each. Meanwhile the next ones are on their way from the other core's
  // cache.
  template <typename Consume>
  void each(const Consume& consume) const {
    each(NoHints{}, consume);
  }
  // The same; tells `hints` of an event of the batch three times before its turn, ever later.
  template <typename Hints, typename Consume>
  void each(const Hints& hints, const Consume& consume) const {
    constexpr std::ptrdiff_t kNext = 3;
    constexpr std::ptrdiff_t kNear = 6;
    constexpr std::ptrdiff_t kFar = 9;
    constexpr std::ptrdiff_t kAhead = 12;
    auto derived = derived_.begin();
    const Event* next = events_.get();
    const Event* cause = next_;  // none yet
    for (;;) {
      const bool is_derived =
          derived != derived_.end() && (derived->cause == cause || next == next_);
      if (!is_derived && next == next_) return;
      const Event* event = nullptr;
      if (is_derived) {
        event = &derived++->event;
      } else {
        event = cause = next++;
        const auto* line = reinterpret_cast<const char*>(event + kAhead);
        for (std::size_t at = 0; at < sizeof(Event); at += kCacheLine)
          prefetch_line<Access::read>(line + at);
        const auto left = next_ - event;
        if (left > kFar) hints.far(event[kFar]);
        if (left > kNear) hints.near(event[kNear]);
        if (left > kNext) hints.next(event[kNext]);
      }
      consume(*event);  // in one place: it may be inlined
    }
  }
  // Without those that follow from them. Valid until the next clear().
  std::span<const Event> events() const noexcept { return {events_.get(), next_}; }
  std::span<Event> events() noexcept { return {events_.get(), next_}; }

 private:
  struct NoHints {
    void far(const Event& /*event*/) const noexcept {}
    void near(const Event& /*event*/) const noexcept {}
    void next(const Event& /*event*/) const noexcept {}
  };
  struct Derived {
    const Event* cause = nullptr;
    Event event;
  };

  void keep_views(EventBody& body);
  void keep_shown(const OtherEvent& event) noexcept;

  std::unique_ptr<Event[]> events_;  // NOLINT(modernize-avoid-c-arrays): what it owns is one
  Event* next_;
  Event* new_;  // the first that take_new() did not give yet
  std::size_t capacity_;
  Event* end_;             // where it is full
  std::size_t shown_ = 0;  // bytes
  std::uint64_t kinds_ = 0;
  std::vector<Derived> derived_;                // in order
  std::pmr::monotonic_buffer_resource memory_;  // what all of them view
};

}  // namespace cie::analysis
