#include "vocabulary.hpp"

#include <algorithm>
#include <map>

namespace cie::analysis::bt {

FieldTable FieldTable::of(const bt_field_class* payload,
                          const std::vector<std::string_view>& names) {
  FieldTable table;
  table.positions.assign(names.size(), -1);
  if (payload == nullptr || bt_field_class_get_type(payload) != BT_FIELD_CLASS_TYPE_STRUCTURE) {
    return table;
  }
  const auto count = bt_field_class_structure_get_member_count(payload);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto* member = bt_field_class_structure_borrow_member_by_index_const(payload, i);
    const std::string_view name = bt_field_class_structure_member_get_name(member);
    for (std::size_t slot = 0; slot < names.size(); ++slot) {
      // Alternatives are written "prev_tid|prev_pid": the first one present wins.
      for (auto rest = names[slot]; !rest.empty() && table.positions[slot] < 0;) {
        const auto bar = std::min(rest.find('|'), rest.size());
        if (rest.substr(0, bar) == name) table.positions[slot] = static_cast<std::int32_t>(i);
        rest.remove_prefix(std::min(bar + 1, rest.size()));
      }
    }
  }
  return table;
}

const bt_field* FieldTable::get(const bt_field* payload, std::size_t slot) const noexcept {
  const auto position = positions[slot];
  if (payload == nullptr || position < 0) return nullptr;
  return bt_field_structure_borrow_member_field_by_index_const(
      payload, static_cast<std::uint64_t>(position));
}

const Translation* find_translation(std::string_view event) {
  static const auto all = [] {
    std::map<std::string_view, const Translation*> by_name;
    for (const auto* vocabulary : {&cie_vocabulary(), &kernel_vocabulary()}) {
      for (const auto& translation : *vocabulary)
        by_name.emplace(translation.event, &translation);
    }
    return by_name;
  }();
  const auto found = all.find(event);
  return found == all.end() ? nullptr : found->second;
}

}  // namespace cie::analysis::bt
