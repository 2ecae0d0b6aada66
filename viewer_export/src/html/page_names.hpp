// What the page calls callbacks and chains. It computes no name of its own.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "json/json.hpp"

namespace cie::viewer_export {

// {"callbacks": […], "chains": […], "words": {…}}: the short names of the report's rows, in their
// order, and for logical ids, and for subjects and notes of verdicts, what the page says instead.
Json page_names(const analysis::AnalysisResult& result);

}  // namespace cie::viewer_export
