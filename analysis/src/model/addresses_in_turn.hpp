// Callbacks that no registration told, as where a recording begins in the run: they are known by their
// addresses alone.
#pragma once

#include "facts.hpp"

namespace cie::analysis {

// A subscription of ROS 2 has two addresses at most, one of them for messages within the process: of three
// that a thread used at the same time two at least are callbacks. Notes which were used so
// (CallbackOnThread::is_of_several). May be called again after more events.
void note_addresses_in_turn(Model& model);

}  // namespace cie::analysis
