// What a recording says of itself, in the words of every text.
#pragma once

#include <cie/analysis/report.hpp>

#include <string>
#include <vector>

namespace cie::viewer_export {

// "cie-demo exited with status 0", "begins with chunk 3: those before are gone": printable,
// without a line end. Its problems are defects of the trace, and told as those.
std::vector<std::string> sentences_of(const analysis::RecordingReport& recording);

}  // namespace cie::viewer_export
