#include "exit_code.hpp"

#include <algorithm>

namespace cie::cli {

int exit_code(const analysis::VerdictReport& verdicts, OnInconclusive on_inconclusive) {
  const bool is_unreadable = std::any_of(
      verdicts.rules.begin(), verdicts.rules.end(),
      [](const auto& rule) { return rule.id == "T1" && rule.verdict == analysis::Verdict::fail; });
  if (is_unreadable) {
    return unreadable;
  }
  switch (verdicts.verdict) {
    case analysis::Verdict::fail:
      return violation;
    case analysis::Verdict::inconclusive:
      return on_inconclusive == OnInconclusive::warn   ? ok
             : on_inconclusive == OnInconclusive::fail ? violation
                                                       : inconclusive;
    case analysis::Verdict::pass:
    case analysis::Verdict::not_applicable:
      break;
  }
  return ok;
}

}  // namespace cie::cli
