// What a screen tells of a callback's longest run.
#pragma once

#include "verify_findings.hpp"

#include <string>

namespace cie::viewer_export {

// Null: none of its runs was noted.
const WorstRun* worst_run_of(const Judged& judged, const analysis::CallbackReport& callback);
// "instance 140 at +1.466 s took 423.0 us: 376.0 us waiting to start, 47.00 us executing": the most
// first, without what is less than a twentieth of all; empty where it did not wait.
std::string where_time_went(const Judged& judged, const WorstRun& worst);

}  // namespace cie::viewer_export
