// Tells the model who nodes, groups, publishers and callbacks are: each once, before it is first
// spoken of.
#pragma once

#include <cie/analysis/event.hpp>

#include "process_state.hpp"

#include <cstdint>

namespace cie::analysis::ros2 {

// A callback of which nothing is known yet is announced later, when something is.
void announce(Callback& callback, const EventHead& head, Process& process, const EventSink& sink);
// Again when its group is known.
void announce_hidden(std::uint32_t number, const EventHead& head, Process& process,
                     const EventSink& sink);
void announce(Publisher& publisher, const EventHead& head, Process& process, const EventSink& sink);

}  // namespace cie::analysis::ros2
