// A thread and what the kernel's record says of it.
#pragma once

#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>

namespace cie::test {

inline const analysis::ThreadReport& thread_of(const analysis::AnalysisResult& result,
                                               std::int64_t tid) {
  return *std::ranges::find(result.report.threads, tid, &analysis::ThreadReport::tid);
}

// A thread of priority 80 that the kernel shows at 50, on a CPU that it may not use, for longer
// than it may take: if these were its switches.
inline constexpr auto kAccused = R"(
  callback fusion
  -100 initial fusion policy=other
  -90 applied fusion policy=fifo priority=80 cpus=0
  10 switch 1 idle fusion next_prio=49
  12 start fusion cpu=0
  18 end fusion cpu=0
  19 switch 1 fusion idle state=1 prio=49
  25 damage kernel
  30 audit fusion policy=fifo priority=80 cpus=0)";
inline constexpr auto kBudget = "callback_groups:\n  - id: fusion\n    wcet: 6\n";

}  // namespace cie::test
