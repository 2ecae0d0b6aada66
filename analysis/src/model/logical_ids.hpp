// What logical ids are made of.
#pragma once

#include <string_view>

namespace cie::analysis {

// "/node@Timer(10)" of "/node@Timer(10)#2".
std::string_view without_number(std::string_view id);

// An id in parts: "/node", "@Timer(10)"; without its number. Views into the id.
struct IdParts {
  explicit IdParts(std::string_view id);
  bool lacks_node() const { return node == "?"; }

  std::string_view node;
  std::string_view what;
};

}  // namespace cie::analysis
