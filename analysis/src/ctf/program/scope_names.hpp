// The fields of a scope by name, while its program is built: what lengths and tags refer to.
#pragma once

#include "ctf/metadata/types.hpp"
#include "program.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis::ctf {

// A field, the fields below it, and where its value is read.
class ScopeNames {
 public:
  std::string name;
  const Type* type = nullptr;  // null: the scope itself, a structure
  ScopeNames* parent = nullptr;
  bool is_open = false;          // being laid out
  Sequence* sequence = nullptr;  // of a number, or of a choice between options
  std::size_t op = 0;
  std::uint32_t offset = 0;  // in a block
  std::int16_t reg = kNone;
  std::int16_t shared_reg = kNone;  // for who stands outside of the option that has it
  std::vector<std::unique_ptr<ScopeNames>> members;

  ScopeNames& add(std::string member, const Type* member_type) {
    members.push_back(std::make_unique<ScopeNames>());
    members.back()->name = std::move(member);
    members.back()->type = member_type;
    members.back()->parent = this;
    return *members.back();
  }
  ScopeNames* find(std::string_view wanted) const {
    for (auto member = members.rbegin(); member != members.rend(); ++member) {
      if ((*member)->name == wanted) return member->get();
    }
    return nullptr;
  }
  bool is_structure() const { return type == nullptr || type->kind == Type::Kind::structure; }
};

}  // namespace cie::analysis::ctf
