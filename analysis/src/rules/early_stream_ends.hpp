// Streams of applications that end before the others of their trace. LTTng ends them as one, so an early one was
// cut: its consumer daemon was killed, the disk was full. No count tells what it lacks. The streams of a chunk
// (`lttng rotate`, `cie record --rotate`) say nothing: there a CPU's stream ends with its last packet. Nor do those
// that another program wrote anew.
#pragma once

#include "model/facts.hpp"

#include <cstdint>
#include <map>

namespace cie::analysis {

// The model must outlive it.
class EarlyStreamEnds {
 public:
  explicit EarlyStreamEnds(const Model& model);

  // The stream that ends first in the sessions that saw the process first, or had it announce what it has; null: none
  // ends early.
  const StreamFacts* of(const ProcessFacts& process) const;

 private:
  std::map<std::uint32_t, const StreamFacts*> first_;  // by trace
};

}  // namespace cie::analysis
