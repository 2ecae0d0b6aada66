// What the page calls callbacks and chains. It computes no name of its own.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "json/json.hpp"

namespace cie::viewer_export {

// {"callbacks": […], "ordinals": {…}, "chains": […], "words": {…}, "order": {…}}: the short names of
// the report's rows, in their order; what tells lives of a callback apart, by its index; for logical ids, and for subjects and notes of verdicts, what the page says
// instead; and of each violated rule its violating subjects, by their places among all, the worst
// first.
Json page_names(const analysis::AnalysisResult& result, const SchedulingSpec* spec);

}  // namespace cie::viewer_export
