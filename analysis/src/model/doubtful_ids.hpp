// Logical ids that a lost registration may have shifted.
#pragma once

#include "facts.hpp"

namespace cie::analysis {

// ROS 2's callbacks of one id are numbered in order of creation (`#2`, `#3`), as far as that was seen.
// Sets `may_be_another` of those that were registered after events of their process may have been lost,
// and beside which there is another of that id, or one of which no id is known. Of all others it is
// cleared. Of processes with ROS 2's callbacks, each looks at all losses and, where there is one, its
// callbacks at those without an id.
void doubt_numbered_ids(Model& model);

}  // namespace cie::analysis
