// Events without a kind of their own, with the fields that their trace declares.
#pragma once

#include <cie/analysis/event_head.hpp>

#include <cstdint>
#include <span>
#include <string_view>

namespace cie::analysis {

// A step through an event's fields as its trace declares them, in their order.
struct FieldValue {
  enum class Kind : std::uint8_t {
    integer,
    natural,  // an integer without a sign: `number` wraps above int64
    boolean,  // 0 or 1
    label,    // of an enumeration: `number`, and what that is called in `text`
    real,     // the bits of a double
    text,     // bytes as they were recorded
    opaque,   // a number of a kind that no machine has
    structure,
    list,  // both: what follows, until `end`, is in it
    end
  };
  Kind kind = Kind::end;
  bool is_hexadecimal = false;  // a number that the trace wants to be shown so
  std::string_view name;        // empty in lists
  std::string_view text{};
  std::int64_t number = 0;
};

// An event that says nothing by itself: of no vocabulary we know, or one from which others follow.
struct OtherEvent {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName{};
  static constexpr std::uint32_t kNoClass = ~std::uint32_t{0};
  std::string_view name;
  // Of a reader that was asked for events themselves (recorded_events.hpp): its class's number
  // instead of the name, and its fields, of which the first `context` values are of contexts.
  std::uint32_t event_class = kNoClass;
  std::uint32_t context = 0;
  std::span<const FieldValue> fields{};
  // It stands for so many, of which the last was no later: readers of files only count what nobody
  // asks for.
  std::uint64_t count = 1;
};

}  // namespace cie::analysis
