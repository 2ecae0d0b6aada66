// A payload with its field table: the few ways in which vocabularies read fields.
#pragma once

#include "bt_fields.hpp"
#include "vocabulary.hpp"

namespace cie::analysis::bt {

struct Payload {
  const bt_field* fields;
  const FieldTable& table;

  const bt_field* field(std::size_t slot) const noexcept { return table.get(fields, slot); }
  template <typename Integer>
  Integer number(std::size_t slot, Integer absent = 0) const noexcept {
    const auto value = read_integer(field(slot));
    return value ? static_cast<Integer>(*value) : absent;
  }
  // An id of the contract; "none" where the trace has no such field.
  template <typename Id>
  Id id(std::size_t slot) const noexcept {
    return static_cast<Id>(number<std::uint32_t>(slot, kNoId));
  }
  std::string_view text(std::size_t slot) const noexcept { return read_string(field(slot)); }
  template <typename Enum>
  std::optional<Enum> label(std::size_t slot) const noexcept {
    return read_enum<Enum>(field(slot));
  }
};

}  // namespace cie::analysis::bt
