#include "exit_code.hpp"

#include <cie/analysis/rule_pages.hpp>

#include "command_line.hpp"

#include <algorithm>

namespace cie::cli {

OnInconclusive on_inconclusive(const std::string& choice) {
  if (choice.empty()) {
    return OnInconclusive::report;
  }
  check_choice("--inconclusive", choice, {"warn", "fail"});
  return choice == "warn" ? OnInconclusive::warn : OnInconclusive::fail;
}

int exit_code(const analysis::VerdictReport& verdicts, OnInconclusive on_inconclusive) {
  const auto readable =
      std::ranges::find(verdicts.rules, analysis::kReadableRule, &analysis::RuleVerdict::id);
  const bool is_judged = readable != verdicts.rules.end();
  if (is_judged && readable->verdict == analysis::Verdict::fail) {
    return unreadable;
  }
  switch (verdicts.verdict) {
    case analysis::Verdict::fail:
      return violation;
    case analysis::Verdict::inconclusive:
      if (on_inconclusive == OnInconclusive::fail) return violation;
      // What was not read, or read by guess, may hold anything: no warning says enough of it.
      if (is_judged && analysis::counted_verdict(*readable) == analysis::Verdict::inconclusive) {
        return inconclusive;
      }
      return on_inconclusive == OnInconclusive::warn ? ok : inconclusive;
    case analysis::Verdict::pass:
    case analysis::Verdict::not_applicable:
      break;
  }
  return ok;
}

}  // namespace cie::cli
