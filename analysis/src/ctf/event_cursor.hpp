// Walks over the events of one packet.
#pragma once

#include "packet.hpp"
#include "program.hpp"
#include "window.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace cie::analysis::ctf {

class EventCursor {
 public:
  // Borrowed. Registers of `frame` hold what the packet's header and context left there.
  EventCursor(Window& window, Frame& frame) : window_(&window), frame_(&frame) {}

  // `clock`: cycles that the stream's clock showed last, for packets without a begin.
  void begin(const Packet& packet, std::uint64_t clock);

  enum class Step : std::uint8_t { event, end, damaged };
  // Reads the next event's header. After `event` comes read_body(), which also skips it.
  Step next();
  // Finds the context's values and those that the event's translation asks for. False: damaged.
  bool read_body() {
    fixed_ = fixed_body();
    if (fixed_ == nullptr) return run_body();
    fixed_begin_ = bits_.data + bits_.at / 8;
    bits_.at += fixed_->bytes * 8;
    return true;
  }
  // Skips events from here on, as many as lie in fixed places.
  void skip_fixed();
  // Like read_body(), without filling anything.
  bool skip_body() {
    if (const auto* fixed = fixed_body()) {
      bits_.at += fixed->bytes * 8;
      return true;
    }
    return run_body();
  }

  // Other streams have their turn before this one's next event is read: by then it is in the cache.
  void prefetch() const noexcept {
    constexpr std::uint64_t kCacheLine = 64;
    if (bits_.end - bits_.at > kCacheLine * 8) {
      __builtin_prefetch(bits_.data + bits_.at / 8 + kCacheLine);
    }
  }

  const EventPlan& plan() const noexcept { return *plan_; }
  std::uint64_t clock() const noexcept { return clock_; }  // cycles, of the event read last
  // After read_body().
  std::optional<std::int64_t> context(ContextSlot which) const noexcept {
    return (fixed_ != nullptr ? Payload(fixed_begin_, fixed_->context.data())
                              : Payload(context_.data()))
        .integer(slot(which));
  }
  Payload payload() const noexcept {
    return fixed_ != nullptr ? Payload(fixed_begin_, fixed_->fields.data())
                             : Payload(fields_.data());
  }

  // After `damaged`: why, and where in the packet.
  std::string reason() const;
  std::uint64_t position() const noexcept { return base_ * 8 + bits_.at; }

 private:
  // The event's fixed layout if it can be used here: on a byte, with readable bytes behind it.
  const EventPlan::FixedBody* fixed_body() const noexcept {
    const auto& fixed = plan_->fixed;
    const bool is_usable = fixed && bits_.at % 8 == 0 && bits_.at < bits_.end &&
                           bits_.end - bits_.at >= (fixed->bytes + FixedField::kSlack) * 8;
    return is_usable ? &*fixed : nullptr;
  }
  bool run_body();
  bool read_fixed_header(const HeaderLayout& layout, std::uint64_t& id);
  Step find_plan(std::uint64_t id);
  Outcome run_here(const Sequence& program, Field* fields);
  bool extend(std::uint64_t at);
  bool is_good(Outcome outcome);
  Step fail(const char* reason);

  Window* window_;
  Frame* frame_;
  const Packet* packet_ = nullptr;
  const EventPlan* plan_ = nullptr;
  Bits bits_;
  std::uint64_t base_ = 0;  // bytes of the packet before bits_.data
  std::uint64_t clock_ = 0;
  std::uint64_t event_begin_ = 0;
  const EventPlan::FixedBody* fixed_ = nullptr;  // of the event read last; null: not used
  const std::uint8_t* fixed_begin_ = nullptr;
  const char* reason_ = "";
  std::array<Field, 2> header_{};
  std::array<Field, 2> context_{};
  std::array<Field, kMaxSlots> fields_{};
};

// A clock's next value from its low `bits` alone.
std::uint64_t extend_clock(std::uint64_t last, std::uint64_t value, std::uint32_t bits) noexcept;

}  // namespace cie::analysis::ctf
