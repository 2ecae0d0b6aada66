// Orders about parameters to a container that runs.
#pragma once

#include "container.hpp"

#include <string>
#include <vector>

namespace cie::container {

// `list [NODE]`, `get NODE NAME`, `set NODE NAME VALUE`, `describe NODE NAME`. Returns what to
// tell. Throws std::invalid_argument for other words, std::runtime_error when it cannot be done.
std::string follow_parameter_order(Container& container, const std::vector<std::string>& words);

}  // namespace cie::container
