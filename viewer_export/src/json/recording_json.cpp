#include "recording_json.hpp"

#include <algorithm>

namespace cie::viewer_export {
namespace {

bool has_something_to_tell(const analysis::RecordingReport& recording) {
  const bool has_failed = recording.exit && recording.exit->code != 0;
  return has_failed || !recording.problems.empty() || recording.first_chunk.value_or(1) > 1;
}

}  // namespace

void write_recordings(RowWriter& document,
                      const std::vector<analysis::RecordingReport>& recordings) {
  if (std::ranges::any_of(recordings, has_something_to_tell)) document("recordings", recordings);
}

}  // namespace cie::viewer_export
