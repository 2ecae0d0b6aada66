// The short cut through programs: what lies at fixed places behind a byte boundary is read without
// running operations. Most events of a recording are of this kind.
#pragma once

#include "../reader/field.hpp"
#include "program.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace cie::analysis::ctf {

// Loads take eight bytes whatever they are for: so many must be readable behind a layout.
constexpr std::uint64_t kLayoutSlack = 8;

// A little-endian integer of at most 64 bits within eight bytes.
struct FixedValue {
  std::uint32_t offset = 0;  // bytes from the layout's begin
  std::uint8_t shift_left = 0;
  std::uint8_t shift_right = 0;
  bool is_signed = false;
  std::int8_t slot = -1;
  std::uint64_t field_head = 0;  // the field's kind, label and length
  const LabelTable* labels = nullptr;

  std::uint64_t load(const std::uint8_t* begin) const noexcept {
    std::uint64_t raw = 0;
    std::memcpy(&raw, begin + offset, sizeof raw);
    raw <<= shift_left;
    return is_signed ? static_cast<std::uint64_t>(static_cast<std::int64_t>(raw) >> shift_right)
                     : raw >> shift_right;
  }
  void store(const std::uint8_t* begin, Field* fields) const noexcept {
    auto& field = fields[slot];
    const auto value = load(begin);
    std::memcpy(static_cast<void*>(&field), &field_head, sizeof field_head);
    field.number = static_cast<std::int64_t>(value);
    if (labels != nullptr) field.label = labels->find(value);
  }
};
static_assert(sizeof(Field) == 16 && offsetof(Field, number) == 8);

// Characters of an array of known length.
struct FixedText {
  std::uint32_t offset = 0;
  std::uint32_t length = 0;
  std::int8_t slot = -1;

  void store(const std::uint8_t* begin, Field* fields) const noexcept {
    const auto* characters = begin + offset;
    const auto* nul = static_cast<const std::uint8_t*>(std::memchr(characters, 0, length));
    auto& field = fields[slot];
    field.kind = Field::Kind::text;
    field.characters = reinterpret_cast<const char*>(characters);
    field.length = nul != nullptr ? static_cast<std::uint32_t>(nul - characters) : length;
  }
};

struct Layout {
  std::uint64_t bytes = 0;
  std::vector<FixedValue> values;
  std::vector<FixedText> texts;
};

// Empty if the scope has parts without a fixed place, or keeps values for others. Null: no scope.
std::optional<Layout> layout_of(const Sequence* program);

// An event header: fixed, or fixed for each range of a tag at its begin (both of LTTng's are).
struct HeaderLayout {
  struct Option {
    std::uint64_t low = 0;
    std::uint64_t high = ~std::uint64_t{0};
    std::uint64_t bytes = 0;
    FixedValue id;
    FixedValue time;
    std::uint32_t time_bits = 64;
  };
  FixedValue tag;
  std::int16_t tag_register = kNone;  // others may refer to it
  std::uint64_t bias = 0;
  std::uint64_t most_bytes = 0;
  std::vector<Option> options;

  const Option* choose(std::uint64_t value) const noexcept {
    for (const auto& option : options) {
      if ((value ^ bias) >= option.low && (value ^ bias) <= option.high) return &option;
    }
    return nullptr;
  }
};

// Empty unless id and time are always there. Slot 0 is the id, slot 1 the time.
std::optional<HeaderLayout> header_layout_of(const Sequence* program);

}  // namespace cie::analysis::ctf
