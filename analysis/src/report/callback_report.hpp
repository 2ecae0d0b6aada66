// A callback's row of the report.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report.hpp>

#include "rules/rule_context.hpp"

namespace cie::analysis {

CallbackReport callback_report(const RuleContext& context, CallbackIndex index, bool keep_buckets);

}  // namespace cie::analysis
