// Drawing a graph with Graphviz, where it is installed.
#pragma once

#include <string>

namespace cie::cli {

// What `dot -Tsvg` makes of a graph in the DOT language. Throws std::runtime_error when Graphviz is
// not installed or refuses.
std::string svg_of(const std::string& dot);

}  // namespace cie::cli
