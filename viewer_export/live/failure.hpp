// What is said where the recorder of what is seen failed: what came last is not all there was.
#pragma once

#include "snapshot.hpp"

#include <string>

namespace cie::live {

// `why`: as it is told, in one verdict with losses that were counted. How many events were lost is
// not known then, and nothing passes.
void note_failure(Snapshot& snapshot, const std::string& why);

}  // namespace cie::live
