// Facts and verdicts into the report.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

namespace cie::analysis {

// `keep_buckets`: see AnalysisOptions.
Report build_report(const Model& model, const VerdictReport& verdicts, bool keep_buckets);

}  // namespace cie::analysis
