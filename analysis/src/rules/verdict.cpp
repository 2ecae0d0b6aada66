#include <cie/analysis/verdict.hpp>

#include <algorithm>

namespace cie::analysis {

Verdict counted_verdict(const RuleVerdict& rule) noexcept {
  if (rule.subjects.empty()) return rule.verdict;
  auto verdict = Verdict::not_applicable;
  for (const auto& subject : rule.subjects) {
    if (!subject.is_suppressed()) verdict = std::max(verdict, subject.verdict);
  }
  return verdict;
}

Verdict overall_verdict(const VerdictReport& verdicts) noexcept {
  const auto applies = [](const RuleVerdict& rule) {
    return rule.verdict != Verdict::not_applicable;
  };
  if (std::ranges::none_of(verdicts.rules, applies)) return Verdict::inconclusive;
  auto verdict = Verdict::pass;
  for (const auto& rule : verdicts.rules)
    verdict = std::max(verdict, counted_verdict(rule));
  return verdict;
}

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
  return "";
}

}  // namespace cie::analysis
