// What recordings say of themselves, as the reports and verdicts in JSON have it.
#pragma once

#include "row_json.hpp"

namespace cie::viewer_export {

// Writes the key `recordings` where there is something to tell: a command that did not end with
// status 0, problems, or chunks that are gone. Each recording is in it then.
void write_recordings(RowWriter& document,
                      const std::vector<analysis::RecordingReport>& recordings);

}  // namespace cie::viewer_export
