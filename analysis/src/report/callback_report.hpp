// The callbacks' rows of the report.
#pragma once

#include <cie/analysis/report.hpp>

#include "rules/rule_context.hpp"

#include <vector>

namespace cie::analysis {

// In the order that verdicts are named by.
std::vector<CallbackReport> callback_reports(const RuleContext& context);

}  // namespace cie::analysis
