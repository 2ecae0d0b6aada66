// The verifier's rules as their documentation.
#pragma once

#include <string_view>
#include <vector>

namespace cie::analysis {

// Rules that programs treat apart from the others.
inline constexpr std::string_view kReadableRule = "T1";  // what cannot be read may hold anything
inline constexpr std::string_view kNoLossRule = "T2";
inline constexpr std::string_view kRunCompleteRule = "T4";  // which --allow-crash relaxes
inline constexpr std::string_view kDeadlineRule = "R3";

struct RulePage {
  std::string_view id;    // "M2"
  std::string_view name;  // "one-callback-per-thread"
  std::string_view page;  // what it means, why it matters, what makes it inconclusive, the remedy
};

// One page per rule, in the contract's order. The views live as long as the program.
std::vector<RulePage> rule_pages();

}  // namespace cie::analysis
