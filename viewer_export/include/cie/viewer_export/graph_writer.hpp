// The callback graph: who takes messages of whom, in the language of Graphviz.
#pragma once

#include <cie/analysis/report.hpp>

#include <ostream>

namespace cie::viewer_export {

// DOT (https://graphviz.org/doc/info/lang.html): processes as clusters, callbacks that messages link
// as boxes with their response times, an edge for every pair of callbacks that a message went
// between, with topic, number of messages and communication latency; dashed where it crosses
// processes. What was published outside every callback of the recording comes from a node of its own
// per topic. How many callbacks no message links, which are left out, is the graph's label. Names are
// quoted and escaped: whatever they hold, the file has no other meaning.
void write_graph_dot(std::ostream& out, const analysis::Report& report);

}  // namespace cie::viewer_export
