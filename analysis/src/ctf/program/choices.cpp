#include "choices.hpp"

#include "ctf/metadata/tokens.hpp"
#include "ctf/metadata/type_limits.hpp"

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
