#include "wants.hpp"

#include "choices.hpp"
#include "ctf/metadata/type_limits.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis::ctf {
namespace {

// In the event header of CTF 1.8 values are found by meaning, at any depth.
Want header_want(const std::string& name, const Type& type) {
  if (!type.clock.empty() || name == "timestamp") return {.slots = {kHeaderTime}};
  if (name == "id") return {.slots = {kHeaderId}};
  return {};
}

}  // namespace

std::string_view plain_name(std::string_view name) {
  return name.starts_with('_') ? name.substr(1) : name;
}

LabelTable label_table_of(const Type& type, std::span<const std::string_view> labels) {
  const bool has_labels = type.kind == Type::Kind::enumeration || !type.ranges.empty();
  const auto bias = has_labels ? bias_of(type) : 0;
  std::vector<LabelTable::Range> ranges;
  if (has_labels) {
    for (const auto& range : type.ranges) {
      const auto found = std::find(labels.begin(), labels.end(), range.label);
      ranges.push_back({.low = range.low ^ bias,
                        .high = range.high ^ bias,
                        .label = found == labels.end()
                                     ? kNone
                                     : static_cast<std::int16_t>(found - labels.begin())});
    }
  } else {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      ranges.push_back({.low = i, .high = i, .label = static_cast<std::int16_t>(i)});
    }
  }
  return {std::move(ranges), bias};
}

std::vector<Want> Wants::by_name(const Type& scope, std::span<const FieldRequest> requests) const {
  std::vector<std::size_t> chosen(requests.size(), SIZE_MAX);
  std::vector<std::size_t> winners(requests.size(), SIZE_MAX);
  for (std::size_t member = 0; member < scope.members.size(); ++member) {
    const auto name = requested_name(scope.members[member].name);
    for (std::size_t slot = 0; slot < requests.size(); ++slot) {
      if (slot < roles_.size() && roles_[slot] != Role::none) continue;
      const auto alternative = requests[slot].alternative(name);
      if (!alternative || *alternative >= chosen[slot]) continue;
      chosen[slot] = *alternative;
      winners[slot] = member;
    }
  }
  std::vector<Want> wants(scope.members.size());
  for (std::size_t slot = 0; slot < requests.size(); ++slot) {
    if (winners[slot] == SIZE_MAX) continue;
    // Two requests for one member: the later slot would stay empty, so no table asks twice.
    auto& want = wants[winners[slot]];
    if (!want.slots.empty()) continue;
    want = {.slots = {static_cast<std::int16_t>(slot)}, .labels = requests[slot].labels};
  }
  return wants;
}

Want Wants::of_field(const std::string& name, const Type& type, const Want& by_name) const {
  if (!has_roles_) return is_header_ && is_number(type) ? header_want(name, type) : by_name;
  auto result = by_name;
  for (std::size_t slot = 0; slot < roles_.size(); ++slot) {
    const bool has_role = roles_[slot] != Role::none &&
                          std::ranges::find(type.roles, roles_[slot]) != type.roles.end();
    if (has_role) result.slots.push_back(static_cast<std::int16_t>(slot));
  }
  return result;
}

}  // namespace cie::analysis::ctf
