// What every rule is: an identity, the parts of its page of documentation, what screens say of its
// violations, and a pure function from the facts to verdicts. Adding a rule touches its own file
// pair and the table in rules.cpp.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "rule_context.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace cie::analysis {

// What a rule is about, and without what it has nothing to judge.
struct RuleNeeds {
  bool is_about_trace = false;  // the recording itself: nothing about processes makes it doubtful
  bool instances = false;       // of callbacks: without any start it has no subject
  bool spec = false;
  bool kernel = false;        // the kernel alone may show why it fails
  bool is_of_report = false;  // the report rests on its verdict
};

struct Rule {
  std::string_view id;    // "M2"
  std::string_view name;  // "one-callback-per-thread"

  // Its page, see RulePage: each part is a paragraph, without what the paragraph begins with.
  std::string_view meaning;
  std::string_view why_it_matters;
  std::string_view inconclusive_when;
  std::string_view remedy;
  std::string_view remedy_rclcpp{};

  std::string_view violation = "broke a rule";  // that of a rule which never fails is not told
  int gravity = 0;                // the mapping, deadlines, then all others in the contract's order
  std::size_t main_evidence = 0;  // of an instance's two events, the end knows all

  std::vector<SubjectVerdict> (*judge)(const RuleContext&);
  RuleNeeds needs{};
};

// Every rule, in the contract's order.
const std::vector<Rule>& rules();

// Judges the facts by the rules that the options ask for, sorts subjects, takes the worst.
VerdictReport verify(const RuleContext& context);

}  // namespace cie::analysis
