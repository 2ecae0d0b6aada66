// Reading fields of libbabeltrace2 without knowing their exact class: width, signedness and base
// differ between tracers. A field of another kind than asked for reads as absent.
#pragma once

#include "vocabulary/field.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {

// Any integer, boolean or enumeration; unsigned values above int64 wrap.
std::optional<std::int64_t> read_integer(const bt_field* field) noexcept;

// Where the fields that were asked for lie in a structure; absent where it has no such field.
class FieldTable {
 public:
  FieldTable() = default;
  // `requests` is borrowed.
  FieldTable(const bt_field_class* structure, const std::vector<FieldRequest>& requests);

  bool has_slot(std::size_t slot) const noexcept { return positions_[slot] >= 0; }
  const bt_field* get(const bt_field* structure, std::size_t slot) const noexcept;
  // Reads them all; views are valid until the next call.
  const Field* read(const bt_field* structure);
  // Has a slot hold something else until then.
  void put(std::size_t slot, const Field& field) { fields_[slot] = field; }

 private:
  Field read_one(const bt_field* field, const FieldRequest& request);

  const std::vector<FieldRequest>* requests_ = nullptr;
  std::vector<std::int32_t> positions_;
  std::array<Field, kMaxSlots> fields_{};
  std::vector<std::uint32_t> elements_;
};

}  // namespace cie::analysis::bt
