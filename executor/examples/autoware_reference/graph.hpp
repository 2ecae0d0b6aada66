// The graph of the Autoware reference system: https://github.com/ros-realtime/reference-system,
// autoware_reference_system. Node names, topics, periods, fan-in and fan-out are those of the
// original; every topic is named after the node that publishes it.
#pragma once

#include <cie/executor/context.hpp>

#include "../common/runner.hpp"
#include "key_figures.hpp"

namespace autoware {

// 24 nodes with 36 callbacks. `figures` is told what it counts and must outlive the nodes.
example::Nodes make_graph(const cie::Context& context, KeyFigures& figures);

}  // namespace autoware
