// The definition of a verdict: all executions that are consistent with a recording are enumerated. FAIL: every one
// violates the rule; PASS: none does.
#pragma once

#include "cie/analysis/verdict.hpp"
#include "small_system.hpp"

#include <map>
#include <optional>

namespace cie::test::small {

// Of each subject. Nothing: there are more executions than are enumerated, or none with lost runs where they are
// presumed (`at_home`).
std::optional<std::map<int, analysis::Verdict>> verdicts_by_definition(const Recording& recording,
                                                                       Rule rule, bool at_home);

}  // namespace cie::test::small
