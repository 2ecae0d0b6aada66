#include "choices.hpp"

#include "tokens.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

namespace cie::analysis::ctf {
namespace {

// Empty if no value of the tag is in the range.
std::optional<std::pair<std::uint64_t, std::uint64_t>> possible(const Selection& selection,
                                                                const Type& tag) {
  using Wide = Selection::Wide;
  const Wide least = tag.is_signed ? Wide{std::numeric_limits<std::int64_t>::min()} : Wide{0};
  const Wide most = tag.is_signed ? Wide{std::numeric_limits<std::int64_t>::max()}
                                  : Wide{std::numeric_limits<std::uint64_t>::max()};
  const auto low = std::max(selection.low, least);
  const auto high = std::min(selection.high, most);
  if (low > high) return std::nullopt;
  return std::pair(static_cast<std::uint64_t>(low), static_cast<std::uint64_t>(high));
}

}  // namespace

void check_selectors(const std::vector<ScopeNames*>& tags) {
  const auto& first = *tags.front()->type;
  for (const auto* tag : tags) {
    const bool is_boolean = tag->type->kind == Type::Kind::boolean;
    if (tag->type->kind == Type::Kind::bits || tag->type->is_signed != first.is_signed ||
        is_boolean != (first.kind == Type::Kind::boolean)) {
      throw MetadataError("the selector \"" + tag->name.substr(0, 100) +
                          "\" is no integer, or now one with a sign and now one without");
    }
  }
}

void add_selections(Op& op, const Type& type, const Type& tag,
                    const std::vector<std::shared_ptr<const Sequence>>& bodies) {
  for (const auto& selection : type.selections) {
    if (const auto range = possible(selection, tag)) {
      op.choices.push_back({.low = range->first ^ op.bias,
                            .high = range->second ^ op.bias,
                            .body = bodies[selection.option]});
    }
  }
}

}  // namespace cie::analysis::ctf
