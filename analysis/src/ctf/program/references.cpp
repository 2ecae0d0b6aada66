#include "references.hpp"

#include "ctf/metadata/tokens.hpp"
#include "ctf/metadata/type_limits.hpp"

#include <algorithm>
#include <array>
#include <string>

namespace cie::analysis::ctf {
namespace {

constexpr std::size_t kMaxLookups = 20'000'000;  // names compared, in one trace
constexpr std::array<std::string_view, 6> kRoots{"trace.packet.header", "stream.packet.context",
                                                 "stream.event.header", "stream.event.context",
                                                 "event.context",       "event.fields"};

std::string described(const FieldLocation& location) {
  std::string text = location.origin;
  for (const auto& step : location.path) {
    if (!text.empty()) text += '.';
    text += step.value_or("(parent)");
    if (text.size() > kShown) break;
  }
  return text.substr(0, kShown);
}

[[noreturn]] void fail(const std::string& reference) {
  throw MetadataError("\"" + reference.substr(0, kShown) +
                      "\", the length or tag of a field, is no integer before it");
}

ScopeNames* structure_around(const ScopeNames& node) {
  auto* parent = node.parent;
  while (parent != nullptr && !parent->is_structure())
    parent = parent->parent;
  return parent;
}

bool contains(const ScopeNames& tree, const ScopeNames& names) {
  const auto* node = &names;
  while (node->parent != nullptr)
    node = node->parent;
  return node == &tree;
}

bool is_choice(const ScopeNames& node) {
  return node.type != nullptr &&
         (node.type->kind == Type::Kind::variant || node.type->kind == Type::Kind::optional);
}

bool is_list(const ScopeNames& node) {
  return node.type != nullptr &&
         (node.type->kind == Type::Kind::array || node.type->kind == Type::Kind::sequence);
}

bool is_in_closed_choice(const ScopeNames& node) {
  for (const auto* around = node.parent; around != nullptr; around = around->parent) {
    if (is_choice(*around) && !around->is_open) return true;
  }
  return false;
}

}  // namespace

Load load_of(const Type& type, ByteOrder trace_order) {
  const auto order = type.byte_order == ByteOrder::native ? trace_order : type.byte_order;
  const bool is_big = order == ByteOrder::big;
  switch (type.size) {
    case 8:
      return type.is_signed ? Load::i8 : Load::u8;
    case 16:
      if (is_big) return type.is_signed ? Load::i16be : Load::u16be;
      return type.is_signed ? Load::i16 : Load::u16;
    case 32:
      if (is_big) return type.is_signed ? Load::i32be : Load::u32be;
      return type.is_signed ? Load::i32 : Load::u32;
    default:
      return is_big ? Load::u64be : Load::u64;
  }
}

void References::count(std::size_t lookups) {
  scope_.context_.lookups += lookups;
  if (scope_.context_.lookups > kMaxLookups) {
    throw MetadataError("lengths and tags are harder to find than any honest tracer makes them");
  }
}

ScopeNames* References::member_of(const ScopeNames& node, std::string_view name) {
  count(node.members.size());
  return node.find(name);
}

std::vector<ScopeNames*> References::find(const ScopeNames& from, const Type& type) {
  if (type.location) {
    auto found = find_by_location(from, *type.location);
    const bool is_good = !found.empty() && std::ranges::all_of(found, [](const auto* names) {
      return names->sequence != nullptr && is_number(*names->type);
    });
    if (!is_good) fail(described(*type.location));
    return found;
  }
  auto* found = find_by_name(type.reference);
  if (found == nullptr || found->type == nullptr || !is_number(*found->type) ||
      found->sequence == nullptr) {
    fail(type.reference);
  }
  return {found};
}

// Absolute, or near it, or in an earlier scope.
ScopeNames* References::find_by_name(std::string_view reference) {
  auto* found = find_absolute(reference);
  for (auto around = around_.rbegin(); found == nullptr && around != around_.rend(); ++around)
    found = walk(*around, reference);
  const auto& scopes = scope_.earlier_;
  for (auto earlier = scopes.rbegin(); found == nullptr && earlier != scopes.rend(); ++earlier)
    found = walk((*earlier)->names_.get(), reference);
  return found;
}

ScopeNames* References::find_absolute(std::string_view path) {
  for (const auto root : kRoots) {
    if (!path.starts_with(root) || path.size() <= root.size() || path[root.size()] != '.') {
      continue;
    }
    path.remove_prefix(root.size() + 1);
    if (root == scope_.root_) return walk(scope_.names_.get(), path);
    for (auto* earlier : scope_.earlier_) {
      if (earlier->root_ == root) return walk(earlier->names_.get(), path);
    }
    return nullptr;
  }
  return nullptr;
}

// "a.b.c" below a node.
ScopeNames* References::walk(ScopeNames* node, std::string_view path) {
  while (node != nullptr && !path.empty()) {
    const auto dot = std::min(path.find('.'), path.size());
    node = member_of(*node, path.substr(0, dot));
    path.remove_prefix(std::min(dot + 1, path.size()));
  }
  return node;
}

ScopeNames* References::origin_of(const ScopeNames& from, const FieldLocation& location) const {
  if (location.origin.empty()) return structure_around(from);
  if (location.origin == scope_.root_) return scope_.names_.get();
  for (auto* earlier : scope_.earlier_) {
    if (earlier->root_ == location.origin) return earlier->names_.get();
  }
  return nullptr;
}

// What a field's value is: of a choice that of its options (of the one that is being laid out, if
// one is), of a list that of the element being laid out.
void References::add_values(ScopeNames& node, std::vector<ScopeNames*>& values) {
  if (is_choice(node) && !node.is_open) {
    count(node.members.size());
    for (const auto& option : node.members)
      add_values(*option, values);
  } else if (is_choice(node) || (is_list(node) && node.is_open)) {
    if (!node.members.empty()) add_values(*node.members.back(), values);
  } else {
    values.push_back(&node);
  }
}

std::vector<ScopeNames*> References::find_by_location(const ScopeNames& from,
                                                      const FieldLocation& location) {
  std::vector<ScopeNames*> found;
  if (auto* origin = origin_of(from, location)) found.push_back(origin);
  for (const auto& step : location.path) {
    std::vector<ScopeNames*> next;
    for (auto* node : found) {
      if (!node->is_structure()) fail(described(location));
      auto* to = step ? member_of(*node, *step) : structure_around(*node);
      if (to != nullptr) add_values(*to, next);
    }
    found = std::move(next);
  }
  return found;
}

std::int16_t References::keep(const std::vector<ScopeNames*>& found) {
  // Who stands in the same option knows that the value is there; others need a register that
  // forgets it where another option is chosen.
  const bool is_shared = found.size() > 1 || is_in_closed_choice(*found.front());
  const auto reg_of = [is_shared](ScopeNames& names) -> std::int16_t& {
    return is_shared ? names.shared_reg : names.reg;
  };
  if (const auto known = reg_of(*found.front()); known >= 0) return known;
  auto& registers = registers_of(*found.front());
  if (registers.next >= registers.end) {
    throw MetadataError("too many lengths and tags in one scope");
  }
  const auto reg = registers.next++;
  for (auto* names : found) {
    reg_of(*names) = reg;
    keep_in(*names, reg);
  }
  return reg;
}

void References::keep_in(ScopeNames& found, std::int16_t reg) {
  auto& op = found.sequence->ops[found.op];
  const auto& type = *found.type;
  if (op.code == Op::Code::block) {
    op.extracts.push_back({.offset = found.offset,
                           .load = load_of(type, scope_.context_.byte_order),
                           .bits = static_cast<std::uint8_t>(type.size),
                           .reg = reg});
  } else if (op.reg < 0) {
    op.reg = reg;
  } else {
    op.extracts.push_back({.reg = reg});
  }
  // Another option may have been chosen.
  for (auto* around = found.parent; around != nullptr; around = around->parent) {
    if (!is_choice(*around) || around->is_open) continue;
    auto& forgets = around->sequence->ops[around->op].forgets;
    if (std::ranges::find(forgets, reg, &Forgotten::reg) != forgets.end()) continue;
    // No length is so large, and no selector with a sign so small: -1 is a usual one.
    constexpr auto kLeast = std::uint64_t{1} << 63U;
    forgets.push_back({.reg = reg, .value = type.is_signed ? kLeast : ~std::uint64_t{0}});
  }
}

RegisterRange& References::registers_of(const ScopeNames& names) {
  for (auto* earlier : scope_.earlier_) {
    if (contains(*earlier->names_, names)) return earlier->registers_;
  }
  return scope_.registers_;
}

}  // namespace cie::analysis::ctf
