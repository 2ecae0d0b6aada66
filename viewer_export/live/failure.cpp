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
  const auto& page = *analysis::find_rule_page(analysis::kNoLossRule);
  snapshot.verdicts.insert(after_violations, VerdictView{.rule = std::string(page.id),
                                                         .name = std::string(page.name),
                                                         .subject = "trace",
                                                         .verdict = Verdict::inconclusive,
                                                         .since_ns = snapshot.time_ns,
                                                         .note = why,
                                                         .says = "trace: " + why});
}

}  // namespace cie::live
