// The verifier's rules as their documentation.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

// Rules that programs treat apart from the others.
inline constexpr std::string_view kReadableRule = "T1";  // what cannot be read may hold anything
inline constexpr std::string_view kNoLossRule = "T2";
inline constexpr std::string_view kRunCompleteRule = "T4";  // which --allow-crash relaxes
inline constexpr std::string_view kSpecifiedCallbackSeenRule = "M1";
inline constexpr std::string_view kOneCallbackPerThreadRule = "M2";
inline constexpr std::string_view kOneThreadPerCallbackRule = "M3";
inline constexpr std::string_view kArrivalExceedsTurnaroundRule = "R1";
inline constexpr std::string_view kNoMissedReleaseRule = "R2";
inline constexpr std::string_view kDeadlineRule = "R3";
inline constexpr std::string_view kBudgetRule = "R4";
inline constexpr std::string_view kNoQueueOverflowRule = "Q1";

// What paragraphs of a page begin with; the first one is the meaning.
inline constexpr std::string_view kWhyItMatters = "Why it matters: ";
inline constexpr std::string_view kInconclusiveWhen = "Inconclusive when ";
inline constexpr std::string_view kRemedy = "Remedy: ";
inline constexpr std::string_view kRemedyWithRclcpp = "Remedy with rclcpp: ";

struct RulePage {
  std::string_view id;    // "M2"
  std::string_view name;  // "one-callback-per-thread"
  std::string page;       // what follows, a paragraph each

  std::string_view meaning;
  std::string_view why_it_matters;
  std::string_view inconclusive_when;
  std::string_view remedy;
  std::string_view remedy_rclcpp;  // empty: it is the same

  std::string_view violation;     // what violating subjects did: "ran several callbacks"
  int gravity = 0;                // of violated rules the larger ones are told first
  std::size_t main_evidence = 0;  // which of a subject's evidence is the first that says why
  bool needs_spec = false;        // without one it does not apply
};

// One page per rule, in the contract's order. It lives as long as the program.
const std::vector<RulePage>& rule_pages();

// "M2", also of "m2".
std::string as_rule_id(std::string text);

// Null: there is no such rule.
const RulePage* find_rule_page(std::string_view id);

}  // namespace cie::analysis
