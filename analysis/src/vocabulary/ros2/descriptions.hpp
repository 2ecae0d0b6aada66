// What tracers say of who is who, entered into a process's directory.
#pragma once

#include "message_links.hpp"
#include "process_state.hpp"
#include "ros2_event.hpp"
#include "vocabulary/field.hpp"

namespace cie::analysis::ros2 {

// What rcl_init says: a context is made, the process's first one or another.
void enter_begin(Address context, const Telling& telling, bool has_emitted, Process& process);
// Ignores events that describe nothing. `quiet`: since the thread's event before.
void enter_description(Ros2Event event, const Telling& telling, const Payload& p, Process& process,
                       Duration quiet, MessageLinks& links);

}  // namespace cie::analysis::ros2
