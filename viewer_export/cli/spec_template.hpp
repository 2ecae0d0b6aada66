// A scheduling spec from what a trace showed.
#pragma once

#include <cie/analysis/report.hpp>

#include <ostream>

namespace cie::cli {

// Writes what SchedulingSpec reads: an entry for each callback and each worker thread with the
// parameters last read back, and what was observed as comments. What was not seen, or was seen
// differently in several places, is written as ~, which is neither applied nor judged; what a spec
// cannot express becomes a comment that says so.
void write_spec_template(std::ostream& out, const analysis::Report& report);

}  // namespace cie::cli
