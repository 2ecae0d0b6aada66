// A scheduling spec from what a trace showed.
#pragma once

#include <cie/analysis/report.hpp>

#include <ostream>

namespace cie::cli {

// Writes what SchedulingSpec reads: an entry for each callback that ran and each worker thread with
// the parameters that S1 judges (last applied, else last read back), and what was observed as
// comments. What was not seen, or was seen differently in several places, is written as ~, which is
// neither applied nor judged; what did not run, or a spec cannot express, becomes a comment that
// says so. So the same recording violates no rule because of it.
void write_spec_template(std::ostream& out, const analysis::Report& report);

}  // namespace cie::cli
