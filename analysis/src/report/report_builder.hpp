// Facts and verdicts into the report.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include "rules/rule_context.hpp"

namespace cie::analysis {

Report build_report(const RuleContext& context, const VerdictReport& verdicts);

}  // namespace cie::analysis
