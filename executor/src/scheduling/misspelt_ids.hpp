// Ids of a spec that nothing here has, and that were probably meant to be something else.
#pragma once

#include <cie/scheduling/problem.hpp>
#include <cie/scheduling/thread_configurator.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <string>
#include <vector>

namespace cie::scheduling {

// One spec may serve several processes, and nodes may be added later; so an id that nothing has is
// misspelt only if its node is here, or something is here that the spec names nowhere and that it
// is near to. Threads of DDS are left out: which there are is the matter of its configuration.
std::vector<SchedulingProblem> misspelt_ids(const SchedulingSpec& spec, const KnownIds& known);

}  // namespace cie::scheduling
