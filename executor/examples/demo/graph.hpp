// The demo's graph: what a car needs from its sensors to its wheels, in two processes.
#pragma once

#include <cie/executor/context.hpp>

#include "../common/runner.hpp"

#include <chrono>

namespace demo {

using example::Nodes;

// Sensors, their transforms, and the fusion of the point clouds: 12 callbacks.
Nodes make_sensing(const cie::Context& context);

// Clusters, localisation, tracking, the planner's cycle, the commands, and two that have time: 16
// callbacks. Each of these two takes `background` of CPU time every 190 ms.
Nodes make_planning(const cie::Context& context, std::chrono::nanoseconds background);

}  // namespace demo
