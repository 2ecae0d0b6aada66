#include "yaml_fields.hpp"

#include <cie/tracepoints/nearest_name.hpp>

#include "text.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace cie::yaml {
namespace {

bool contains(Keys keys, std::string_view key) {
  return std::ranges::find(keys, key) != keys.end();
}

// "; did you mean "priority"?", "; known are id and name", "; man cie-spec lists those that are".
std::string advice(std::string_view key, Keys known, Keys more, std::string_view list) {
  std::vector<std::string> all(known.begin(), known.end());
  all.insert(all.end(), more.begin(), more.end());
  if (auto meant = did_you_mean(key, all); !meant.empty()) return meant;
  if (!list.empty()) return "; " + std::string(list) + " lists those that are known";
  return "; known are " + joined(all);
}

// What the map calls itself, for messages; empty if nothing.
std::string entry_name(const std::vector<std::pair<std::string, Value>>& fields) {
  for (const auto& [key, value] : fields) {
    if ((key == "id" || key == "name") && value.is_scalar()) return value.text(key);
  }
  return {};
}

}  // namespace

Fields::Fields(const Value& map, std::string_view what, Keys known, Keys more, Keys ignored,
               std::string_view list)
    : map_(map) {
  for (auto& [key, value] : map.fields(what)) {
    if (contains(known, key) || contains(more, key)) {
      if (!value.is_null()) fields_.emplace_back(key, value);
    } else if (!contains(ignored, key)) {
      map.key(key)
          .of_entry(entry_name(map.fields(what)))
          .fail("unknown key \"" + key + "\"" + advice(key, known, more, list));
    }
  }
}

const Value* Fields::find(std::string_view key) const {
  const auto field = std::ranges::find(fields_, key, &std::pair<std::string, Value>::first);
  return field == fields_.end() ? nullptr : &field->second;
}

std::optional<std::int64_t> Fields::integer(std::string_view key, std::int64_t min,
                                            std::int64_t max) const {
  const Value* value = find(key);
  if (value == nullptr) return std::nullopt;
  return value->integer(key, min, max);
}

std::optional<std::int64_t> Fields::duration(std::string_view key, std::int64_t min,
                                             std::int64_t max) const {
  const Value* value = find(key);
  if (value == nullptr) return std::nullopt;
  return value->duration(key, min, max);
}

std::optional<std::uint64_t> Fields::count(std::string_view key) const {
  const auto value = integer(key, 0);
  if (!value) return std::nullopt;
  return static_cast<std::uint64_t>(*value);
}

void Fields::set_entry(std::string_view entry) {
  map_ = map_.of_entry(entry);
  for (auto& [key, value] : fields_)
    value = value.of_entry(entry);
}

}  // namespace cie::yaml
