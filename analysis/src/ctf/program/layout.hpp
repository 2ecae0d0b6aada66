// The short cut through programs: what lies at fixed places behind a byte boundary is read without
// running operations. Most events of a recording are of this kind.
#pragma once

#include "program.hpp"
#include "vocabulary/fixed_field.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace cie::analysis::ctf {

struct Layout {
  std::uint64_t bytes = 0;
  std::vector<FixedField> fields;  // those asked for
};

// Empty if the scope has parts without a fixed place, or keeps values for others. Null: no scope.
std::optional<Layout> layout_of(const Sequence* program);

// A clock's next value from its low bits, those of `mask`, alone.
inline std::uint64_t extend_clock_by(std::uint64_t last, std::uint64_t value,
                                     std::uint64_t mask) noexcept {
  const auto next = (last & ~mask) | (value & mask);
  return next < last ? next + mask + 1 : next;
}

// What the header of an event says.
struct EventHeader {
  std::uint64_t id = 0;
  std::uint64_t clock = 0;  // cycles
  std::uint64_t bytes = 0;  // that it fills
};

// A header of LTTng on machines that align nothing: a tag that is the id, and some bits of the time
// (`struct event_header_compact`, `_large` of its metadata); or, if all bits of the tag are set, id
// and time whole behind it.
template <unsigned kTagBits, unsigned kTimeBits>
struct LttngHeader {
  static constexpr std::uint64_t kTagMask = (std::uint64_t{1} << kTagBits) - 1;
  static constexpr std::uint64_t kTimeMask = (std::uint64_t{1} << kTimeBits) - 1;
  static constexpr std::uint64_t kShortBytes = (kTagBits + kTimeBits) / 8;
  static constexpr std::uint64_t kIdOffset = (kTagBits + 7) / 8;
  static constexpr std::uint64_t kTimeOffset = kIdOffset + sizeof(std::uint32_t);
  static constexpr std::uint64_t kLongBytes = kTimeOffset + sizeof(std::uint64_t);

  // The header that begins there, after an event whose clock was `last`.
  static EventHeader read(const std::uint8_t* begin, std::uint64_t last) noexcept {
    const auto raw = load<std::uint64_t>(begin);
    const auto tag = raw & kTagMask;
    if (tag != kTagMask) {
      return {.id = tag,
              .clock = extend_clock_by(last, raw >> kTagBits, kTimeMask),
              .bytes = kShortBytes};
    }
    return {.id = load<std::uint32_t>(begin + kIdOffset),
            .clock = load<std::uint64_t>(begin + kTimeOffset),
            .bytes = kLongBytes};
  }

 private:
  template <typename Integer>
  static Integer load(const std::uint8_t* begin) noexcept {
    Integer value = 0;
    std::memcpy(&value, begin, sizeof value);
    return value;
  }
};
using CompactHeader = LttngHeader<5, 27>;
using LargeHeader = LttngHeader<16, 32>;

// An event header: fixed, or fixed for each range of a tag at its begin (both of LTTng's are).
struct HeaderLayout {
  struct Option {
    std::uint64_t low = 0;
    std::uint64_t high = ~std::uint64_t{0};
    std::uint64_t bytes = 0;
    FixedField id;
    FixedField time;  // its mask are the bits that it has of the clock

    bool is_chosen_by(std::uint64_t value) const noexcept { return value - low <= high - low; }
  };
  FixedField tag;                     // always 0 without one: then there is one option
  std::int16_t tag_register = kNone;  // others may refer to it
  std::uint64_t most_bytes = 0;
  std::vector<Option> options;
  // Those that a compiler knows are read in half the time.
  enum class Shape : std::uint8_t { other, compact, large };
  Shape shape = Shape::other;

  // The header that begins there, after an event whose clock was `last`. Empty: the tag selects none.
  std::optional<EventHeader> read(const std::uint8_t* begin, std::uint64_t last) const noexcept {
    const auto* option = choose(tag.load_unsigned(begin));
    if (option == nullptr) return std::nullopt;
    return EventHeader{
        .id = option->id.load_unsigned(begin),
        .clock = extend_clock_by(last, option->time.load_unsigned(begin), option->time.mask),
        .bytes = option->bytes};
  }
  // Null: the tag selects none.
  const Option* choose(std::uint64_t tag_value) const noexcept {
    for (const auto& option : options) {
      if (option.is_chosen_by(tag_value)) return &option;
    }
    return nullptr;
  }
};

// Empty unless id and time are always there, without signs. Slot 0 is the id, slot 1 the time.
std::optional<HeaderLayout> header_layout_of(const Sequence* program);

}  // namespace cie::analysis::ctf
