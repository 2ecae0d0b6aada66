#include "rule.hpp"

#include <algorithm>

namespace cie::analysis {

std::string_view label(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::not_applicable:
      return "NOT_APPLICABLE";
    case Verdict::pass:
      return "PASS";
    case Verdict::inconclusive:
      return "INCONCLUSIVE";
    case Verdict::fail:
      return "FAIL";
  }
  return {};
}

const std::vector<Rule>& rules() {
  static const std::vector<Rule> table;
  return table;
}

VerdictReport verify(const RuleContext& context) {
  VerdictReport report{.verdict = Verdict::pass, .rules = {}};
  for (const auto& rule : rules()) {
    RuleVerdict verdict{.id = std::string(rule.id),
                        .name = std::string(rule.name),
                        .verdict = Verdict::not_applicable,
                        .subjects = {}};
    verdict.subjects = rule.judge(context);
    for (const auto& subject : verdict.subjects) {
      verdict.verdict = std::max(verdict.verdict, subject.verdict);
    }
    report.verdict = std::max(report.verdict, verdict.verdict);
    report.rules.push_back(std::move(verdict));
  }
  return report;
}

}  // namespace cie::analysis
