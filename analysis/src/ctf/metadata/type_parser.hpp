// Types of TSDL: integer, enum, struct, variant…, their aliases and the declarators of fields.
#pragma once

#include "tokens.hpp"
#include "types.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace cie::analysis::ctf {

// Right side of "name = value;".
struct AttributeValue {
  std::string text;          // a name with its dots, or a text's characters; a number as written
  std::uint64_t number = 0;  // two's complement if it was negative
  bool is_number = false;
};

// Reads from `tokens`, which it shares with the parser of blocks. Nesting is bounded.
class TypeParser {
 public:
  explicit TypeParser(Tokens& tokens) : tokens_(tokens), scopes_(1) {}

  // Names declared after it vanish with leave(): a block or a structure is a scope.
  void enter() { scopes_.emplace_back(); }
  void leave() { scopes_.pop_back(); }
  // Names were declared in the block or structure itself.
  bool has_own_names() const noexcept { return !scopes_.back().empty(); }
  // Leaves whatever an error ended in, but for what had been entered when it was so deep.
  std::size_t depth() const noexcept { return scopes_.size(); }
  void leave_to(std::size_t depth) {
    scopes_.resize(depth);
    nesting_ = 0;
  }
  void leave_all() { leave_to(1); }

  // "typealias…;", "typedef…;", "struct name {…};" and the like, if one stands here.
  bool accept_declaration();
  // A type where no field name follows.
  TypeRef type();
  // "name.name.name"
  std::string dotted_name();
  AttributeValue value();

 private:
  using Scope = std::map<std::string, TypeRef, std::less<>>;

  TypeRef specifier(bool is_before_declarator);
  TypeRef alias(bool is_before_declarator);
  TypeRef integer();
  TypeRef real();
  TypeRef string();
  TypeRef enumeration();
  TypeRef structure();
  TypeRef variant();
  TypeRef named(const char* keyword, const std::string& name) const;
  void declare(const std::string& name, TypeRef type);
  void members(Type& parent);
  NamedType declarator(TypeRef type);
  void ranges(Type& type);
  std::uint64_t constant();
  std::uint32_t alignment(const AttributeValue& value) const;
  ByteOrder byte_order(const AttributeValue& value) const;
  template <typename OnAttribute>
  void attributes(OnAttribute&& on_attribute);
  TypeRef finish(Type type) const;

  Tokens& tokens_;
  std::vector<Scope> scopes_;
  // By how they are written, which repeats: what they are does not depend on where they stand.
  std::unordered_map<std::string_view, TypeRef> integers_;
  TypeRef string_;  // all are alike; null: there was none yet
  std::uint32_t nesting_ = 0;
};

}  // namespace cie::analysis::ctf
