// Logical ids that a lost registration may have shifted.
#pragma once

#include "facts.hpp"

namespace cie::analysis {

// ROS 2's callbacks of one id are numbered in order of creation (`#2`, `#3`), as far as that was seen.
// Sets `may_be_another` of those that were registered after events of their process may have been lost,
// and beside which there is another of that id, or one of which no id or no node is known; of those
// beside one of which no id is known in a process that was there before the recording; of those
// beside one whose id is known in part and may be theirs; and of those with a number that were made
// after an rcl_init that was not the first sign of their pid: the one before may be another process's.
// Of all others it is cleared.
// Sets `least_number`, too: no event of ROS 2 tells that a callback is gone, whose number the next one of
// its id would have then, as where a node makes its timer anew. One that was seen later was not gone.
// O(n log n); of processes with ROS 2's callbacks, those behind a loss also
// look at the ones without an id.
void doubt_numbered_ids(Model& model);

}  // namespace cie::analysis
