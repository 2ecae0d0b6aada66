// What a screen tells of a callback's longest run.
#pragma once

#include "verify_findings.hpp"

#include <string>

namespace cie::viewer_export {

// Null: none of its runs was noted.
const WorstRun* worst_run_of(const Judged& judged, const analysis::CallbackReport& callback);
// "instance 140 at +1.466 s: 376.0 us waiting to start (of 423.0 us)"; empty where nothing of it was.
std::string where_time_went(const Judged& judged, const WorstRun& worst);

}  // namespace cie::viewer_export
