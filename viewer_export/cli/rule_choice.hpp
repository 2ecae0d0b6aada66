// `--only` and `--skip`: which rules a verdict is made of.
#pragma once

#include <cie/analysis/verdict.hpp>

#include <string>
#include <vector>

namespace cie::cli {

class RuleChoice {
 public:
  // Comma-separated ids, in either case; empty: all, or none. Throws UsageError for what is no
  // rule, and when both are given.
  RuleChoice(const std::string& only, const std::string& skip);

  // Leaves the other rules out; the overall verdict is that of those that stay.
  void apply(analysis::VerdictReport& verdicts) const;

 private:
  bool is_chosen(const std::string& id) const;

  std::vector<std::string> only_;
  std::vector<std::string> skip_;
};

}  // namespace cie::cli
