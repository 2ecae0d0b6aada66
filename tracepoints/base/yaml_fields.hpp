// The fields of a YAML map by name, with every unknown one refused.
#pragma once

#include "yaml_document.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::yaml {

using Keys = std::span<const std::string_view>;

// A null value counts as absent. Throws SpecError for a key that is in none of the three lists, with
// the nearest one that is, else with all of them, or with where they are listed; those of `ignored`
// are accepted and not kept.
class Fields {
 public:
  // `what` names the map in messages; `list`: "man cie-spec", where there are many.
  Fields(const Value& map, std::string_view what, Keys known, Keys more = {}, Keys ignored = {},
         std::string_view list = {});

  const Value* find(std::string_view key) const;  // null if absent
  std::optional<std::int64_t> integer(
      std::string_view key, std::int64_t min,
      std::int64_t max = std::numeric_limits<std::int64_t>::max()) const;
  // Nanoseconds, also with a unit.
  std::optional<std::int64_t> duration(
      std::string_view key, std::int64_t min,
      std::int64_t max = std::numeric_limits<std::int64_t>::max()) const;
  std::optional<std::uint64_t> count(std::string_view key) const;

  // From now on messages about the map and its values say that they belong to `entry`.
  void set_entry(std::string_view entry);
  const Value& map() const { return map_; }

 private:
  Value map_;
  std::vector<std::pair<std::string, Value>> fields_;
};

}  // namespace cie::yaml
