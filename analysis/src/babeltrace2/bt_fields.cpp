#include "bt_fields.hpp"

#include <algorithm>
#include <cassert>
#include <string_view>

namespace cie::analysis::bt {
namespace {

std::optional<std::int64_t> integer_of(const bt_field* field) noexcept {
  if (field == nullptr) return std::nullopt;
  switch (bt_field_get_class_type(field)) {
    case BT_FIELD_CLASS_TYPE_UNSIGNED_INTEGER:
    case BT_FIELD_CLASS_TYPE_UNSIGNED_ENUMERATION:
      return static_cast<std::int64_t>(bt_field_integer_unsigned_get_value(field));
    case BT_FIELD_CLASS_TYPE_SIGNED_INTEGER:
    case BT_FIELD_CLASS_TYPE_SIGNED_ENUMERATION:
      return bt_field_integer_signed_get_value(field);
    case BT_FIELD_CLASS_TYPE_BOOL:
      return bt_field_bool_get_value(field) != 0 ? 1 : 0;
    default:
      return std::nullopt;
  }
}

std::string_view read_label(const bt_field* field) noexcept {
  bt_field_class_enumeration_mapping_label_array labels = nullptr;
  std::uint64_t count = 0;
  switch (bt_field_get_class_type(field)) {
    case BT_FIELD_CLASS_TYPE_UNSIGNED_ENUMERATION:
      if (bt_field_enumeration_unsigned_get_mapping_labels(field, &labels, &count) !=
          BT_FIELD_ENUMERATION_GET_MAPPING_LABELS_STATUS_OK) {
        bt_current_thread_clear_error();
        return {};
      }
      break;
    case BT_FIELD_CLASS_TYPE_SIGNED_ENUMERATION:
      if (bt_field_enumeration_signed_get_mapping_labels(field, &labels, &count) !=
          BT_FIELD_ENUMERATION_GET_MAPPING_LABELS_STATUS_OK) {
        bt_current_thread_clear_error();
        return {};
      }
      break;
    default:
      return {};
  }
  return count > 0 ? std::string_view(labels[0]) : std::string_view{};
}

Field number_field(std::int64_t value) noexcept {
  Field result;
  result.kind = Field::Kind::integer;
  result.number = value;
  return result;
}

bool is_array(bt_field_class_type type) noexcept {
  return type == BT_FIELD_CLASS_TYPE_STATIC_ARRAY ||
         type == BT_FIELD_CLASS_TYPE_DYNAMIC_ARRAY_WITH_LENGTH_FIELD ||
         type == BT_FIELD_CLASS_TYPE_DYNAMIC_ARRAY_WITHOUT_LENGTH_FIELD;
}

bool is_enumeration(bt_field_class_type type) noexcept {
  return type == BT_FIELD_CLASS_TYPE_UNSIGNED_ENUMERATION ||
         type == BT_FIELD_CLASS_TYPE_SIGNED_ENUMERATION;
}

// By label; by number where the trace has a plain integer.
std::int16_t label_of(const bt_field* field, std::int64_t value,
                      std::span<const std::string_view> labels) noexcept {
  if (labels.empty()) return -1;
  if (is_enumeration(bt_field_get_class_type(field))) {
    const auto found = std::find(labels.begin(), labels.end(), read_label(field));
    return found == labels.end() ? std::int16_t{-1}
                                 : static_cast<std::int16_t>(found - labels.begin());
  }
  const bool is_known = value >= 0 && value < static_cast<std::int64_t>(labels.size());
  return is_known ? static_cast<std::int16_t>(value) : std::int16_t{-1};
}

}  // namespace

std::optional<std::int64_t> read_integer(const bt_field* field) noexcept {
  return integer_of(field);
}

FieldTable::FieldTable(const bt_field_class* structure, const std::vector<FieldRequest>& requests)
    : requests_(&requests), positions_(requests.size(), -1) {
  assert(requests.size() <= kMaxSlots);
  if (structure == nullptr || bt_field_class_get_type(structure) != BT_FIELD_CLASS_TYPE_STRUCTURE) {
    return;
  }
  std::vector<std::size_t> chosen(requests.size(), SIZE_MAX);
  const auto count = bt_field_class_structure_get_member_count(structure);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto* member = bt_field_class_structure_borrow_member_by_index_const(structure, i);
    const std::string_view name = bt_field_class_structure_member_get_name(member);
    for (std::size_t slot = 0; slot < requests.size(); ++slot) {
      const auto alternative = requests[slot].alternative(name);
      if (!alternative || *alternative >= chosen[slot]) continue;
      chosen[slot] = *alternative;
      positions_[slot] = static_cast<std::int32_t>(i);
    }
  }
}

const bt_field* FieldTable::get(const bt_field* structure, std::size_t slot) const noexcept {
  const auto position = positions_[slot];
  if (structure == nullptr || position < 0) return nullptr;
  return bt_field_structure_borrow_member_field_by_index_const(
      structure, static_cast<std::uint64_t>(position));
}

Field FieldTable::read_one(const bt_field* field, const FieldRequest& request) {
  if (field == nullptr) return {};
  const auto type = bt_field_get_class_type(field);
  if (const auto value = integer_of(field)) {
    auto result = number_field(*value);
    result.label = label_of(field, *value, request.labels);
    return result;
  }
  Field result;
  if (type == BT_FIELD_CLASS_TYPE_STRING) {
    result.kind = Field::Kind::text;
    result.characters = bt_field_string_get_value(field);
    result.length = static_cast<std::uint32_t>(bt_field_string_get_length(field));
  } else if (is_array(type)) {
    elements_.clear();
    const auto length = std::min<std::uint64_t>(bt_field_array_get_length(field), kMaxElements);
    for (std::uint64_t i = 0; i < length; ++i) {
      const auto value = integer_of(bt_field_array_borrow_element_field_by_index_const(field, i));
      if (value) elements_.push_back(static_cast<std::uint32_t>(*value));
    }
    result.kind = Field::Kind::integers;
    result.elements = elements_.data();
    result.length = static_cast<std::uint32_t>(elements_.size());
  }
  return result;
}

const Field* FieldTable::read(const bt_field* structure) {
  for (std::size_t slot = 0; slot < positions_.size(); ++slot) {
    fields_[slot] = read_one(get(structure, slot), (*requests_)[slot]);
  }
  return fields_.data();
}

}  // namespace cie::analysis::bt
