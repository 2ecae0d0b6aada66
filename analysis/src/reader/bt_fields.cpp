#include "bt_fields.hpp"

#include <algorithm>

namespace cie::analysis::bt {

std::optional<std::int64_t> read_integer(const bt_field* field) noexcept {
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

std::string_view read_string(const bt_field* field) noexcept {
  if (field == nullptr || bt_field_get_class_type(field) != BT_FIELD_CLASS_TYPE_STRING) return {};
  return {bt_field_string_get_value(field), bt_field_string_get_length(field)};
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

void read_integers(const bt_field* field, std::size_t limit, std::vector<std::uint32_t>& values) {
  if (field == nullptr) return;
  const auto type = bt_field_get_class_type(field);
  const bool is_array = type == BT_FIELD_CLASS_TYPE_STATIC_ARRAY ||
                        type == BT_FIELD_CLASS_TYPE_DYNAMIC_ARRAY_WITH_LENGTH_FIELD ||
                        type == BT_FIELD_CLASS_TYPE_DYNAMIC_ARRAY_WITHOUT_LENGTH_FIELD;
  if (!is_array) return;
  const auto length = std::min<std::uint64_t>(bt_field_array_get_length(field), limit);
  for (std::uint64_t i = 0; i < length; ++i) {
    const auto value = read_integer(bt_field_array_borrow_element_field_by_index_const(field, i));
    if (value) values.push_back(static_cast<std::uint32_t>(*value));
  }
}

}  // namespace cie::analysis::bt
