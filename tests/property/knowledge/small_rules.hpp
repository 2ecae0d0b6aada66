// What a recording of the small system shows, its proofs, and what eleven rules claim of it: the claims of the real rules
// in their shortest form.
#pragma once

#include "cie/analysis/verdict.hpp"
#include "small_system.hpp"

#include <string>

namespace cie::test::small {

struct Judged {
  analysis::Verdict verdict{};
  std::string why;  // of INCONCLUSIVE
};

// By claims, gaps and proofs. `at_home`: lost runs are presumed on threads where their callback is seen to run.
Judged judge(const Recording& recording, Rule rule, int subject, bool at_home);

}  // namespace cie::test::small
