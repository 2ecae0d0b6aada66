// The demo's graph: what a car needs from its sensors to its wheels, in two processes.
#pragma once

#include <cie/executor/context.hpp>

#include "../common/runner.hpp"

namespace demo {

using example::Nodes;

// Sensors, their transforms, and the fusion of the point clouds: 12 callbacks.
Nodes make_sensing(const cie::Context& context);

// Clusters, localisation, tracking, the planner's cycle, and the commands: 14 callbacks.
Nodes make_planning(const cie::Context& context);

}  // namespace demo
