#include "failure.hpp"

#include <cie/analysis/rule_pages.hpp>

#include <algorithm>

namespace cie::live {

using analysis::Verdict;

void note_failure(Snapshot& snapshot, const std::string& why) {
  snapshot.message = why;
  snapshot.lost_events.reset();
  snapshot.verdict = std::max(snapshot.verdict, Verdict::inconclusive);
  const auto after_violations = std::ranges::find_if(
      snapshot.verdicts, [](const VerdictView& view) { return view.verdict != Verdict::fail; });
  snapshot.verdicts.insert(after_violations, VerdictView{.rule = std::string(analysis::kNoLossRule),
                                                         .name = "no-loss",
                                                         .subject = "trace",
                                                         .verdict = Verdict::inconclusive,
                                                         .since_ns = snapshot.time_ns,
                                                         .note = why,
                                                         .says = "trace: " + why});
}

}  // namespace cie::live
