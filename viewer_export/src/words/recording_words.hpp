// What a recording says of itself, in the words of every text.
#pragma once

#include <cie/analysis/report.hpp>

#include <optional>
#include <string>
#include <vector>

namespace cie::viewer_export {

// "cie-demo exited with status 0", "begins with chunk 3: those before are gone": printable,
// without a line end. Its problems are defects of the trace, and told as those.
std::vector<std::string> sentences_of(const analysis::RecordingReport& recording);

// Whether all that happened was recorded; empty: nothing is missing that anybody knows of.
std::optional<bool> is_complete(const analysis::Report& report);

}  // namespace cie::viewer_export
