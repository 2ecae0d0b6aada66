// Reading fields of libbabeltrace2 without knowing their exact class: width, signedness and base
// differ between tracers. A field of another kind than asked for reads as absent.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {

// Any integer, boolean or enumeration; unsigned values above int64 wrap.
std::optional<std::int64_t> read_integer(const bt_field* field) noexcept;
// Empty if it is not a string.
std::string_view read_string(const bt_field* field) noexcept;
// The first label of an enumeration's value; empty if it has none.
std::string_view read_label(const bt_field* field) noexcept;
// An array or sequence of integers, at most `limit` of them, appended to `values`.
void read_integers(const bt_field* field, std::size_t limit, std::vector<std::uint32_t>& values);

// An enumeration of the contract: by label; by number where the trace has a plain integer.
template <typename Enum>
std::optional<Enum> read_enum(const bt_field* field) noexcept {
  if (field == nullptr) return std::nullopt;
  const auto text = read_label(field);
  for (std::size_t i = 0; i < Labels<Enum>::kValues.size(); ++i) {
    if (Labels<Enum>::kValues[i] == text) return static_cast<Enum>(i);
  }
  if (!text.empty()) return std::nullopt;
  const auto type = bt_field_get_class_type(field);
  if (type != BT_FIELD_CLASS_TYPE_UNSIGNED_INTEGER && type != BT_FIELD_CLASS_TYPE_SIGNED_INTEGER) {
    return std::nullopt;
  }
  const auto number = read_integer(field);
  if (!number || *number < 0 ||
      *number >= static_cast<std::int64_t>(Labels<Enum>::kValues.size())) {
    return std::nullopt;
  }
  return static_cast<Enum>(*number);
}

}  // namespace cie::analysis::bt
