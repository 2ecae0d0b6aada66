#include "choices.hpp"

#include "ctf/metadata/tokens.hpp"
#include "ctf/metadata/type_limits.hpp"
#include "wants.hpp"

#include <string_view>
#include <unordered_map>

namespace cie::analysis::ctf {

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

void add_labelled(Op& op, const Type& type, const Type& tag,
                  const std::vector<std::shared_ptr<const Sequence>>& bodies, ProgramWriter& out) {
  std::unordered_multimap<std::string_view, const EnumerationRange*> by_label;
  for (const auto& range : tag.ranges)
    by_label.emplace(plain_name(range.label), &range);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    auto [next, end] = by_label.equal_range(plain_name(type.members[i].name));
    for (; next != end; ++next) {
      out.count(1);
      const auto& range = *next->second;
      op.choices.push_back(
          {.low = range.low ^ op.bias, .high = range.high ^ op.bias, .body = bodies[i]});
    }
  }
}

void add_selections(Op& op, const Type& type, const Type& tag,
                    const std::vector<std::shared_ptr<const Sequence>>& bodies) {
  for (const auto& selection : type.selections) {
    if (const auto range = representable(selection.low, selection.high, tag.is_signed)) {
      op.choices.push_back({.low = range->first ^ op.bias,
                            .high = range->second ^ op.bias,
                            .body = bodies[selection.option]});
    }
  }
}

}  // namespace cie::analysis::ctf
