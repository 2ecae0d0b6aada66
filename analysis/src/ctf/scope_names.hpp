// The fields of a scope by name, while its program is built: what lengths and tags refer to.
#pragma once

#include "program.hpp"
#include "types.hpp"

#include <algorithm>
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
  const Type* type = nullptr;
  Sequence* sequence = nullptr;
  std::size_t op = 0;
  std::uint32_t offset = 0;  // in a block
  std::int16_t reg = kNone;
  std::vector<std::unique_ptr<ScopeNames>> members;

  ScopeNames* find(std::string_view wanted) const {
    for (auto member = members.rbegin(); member != members.rend(); ++member) {
      if ((*member)->name == wanted) return member->get();
    }
    return nullptr;
  }
};

// Walks "a.b.c" below a node.
inline ScopeNames* walk(ScopeNames* node, std::string_view path) {
  while (node != nullptr && !path.empty()) {
    const auto dot = std::min(path.find('.'), path.size());
    node = node->find(path.substr(0, dot));
    path.remove_prefix(std::min(dot + 1, path.size()));
  }
  return node;
}

}  // namespace cie::analysis::ctf
