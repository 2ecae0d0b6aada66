// What a rule would have judged, had it been recorded: the trace is a subject that needs it.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "rule.hpp"
#include "rule_context.hpp"

#include <vector>

namespace cie::analysis {

void add_unseen_subjects(const Rule& rule, const RuleContext& context,
                         std::vector<SubjectVerdict>& subjects);

}  // namespace cie::analysis
