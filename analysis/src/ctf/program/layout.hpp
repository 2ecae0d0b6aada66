// The short cut through programs: what lies at fixed places behind a byte boundary is read without
// running operations. Most events of a recording are of this kind.
#pragma once

#include "program.hpp"
#include "vocabulary/fixed_field.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace cie::analysis::ctf {

struct Layout {
  std::uint64_t bytes = 0;
  std::vector<FixedField> fields;  // those asked for
};

// Empty if the scope has parts without a fixed place, or keeps values for others. Null: no scope.
std::optional<Layout> layout_of(const Sequence* program);

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
