#include "failure.hpp"

#include <cie/analysis/rule_pages.hpp>

#include <algorithm>
#include <iterator>
#include <string_view>

namespace cie::live {

using analysis::Verdict;

namespace {

constexpr std::string_view kSubject = "trace";

// What is said of the losses that were counted stays, behind the failure.
void add_reason(VerdictView& view, const std::string& why) {
  if (view.note.starts_with(why)) return;
  const auto begin = std::string(kSubject) + ": ";
  auto says = view.says.starts_with(begin) ? view.says.substr(begin.size()) : view.says;
  if (says.empty()) says = view.note;
  view.note = why + "; " + view.note;
  view.says = begin + why + "; " + says;
}

VerdictView failed(const Snapshot& snapshot, const std::string& why) {
  const auto& page = *analysis::find_rule_page(analysis::kNoLossRule);
  return {.rule = std::string(page.id),
          .name = std::string(page.name),
          .subject = std::string(kSubject),
          .verdict = Verdict::inconclusive,
          .since_ns = snapshot.time_ns,
          .note = why,
          .says = std::string(kSubject) + ": " + why};
}

}  // namespace

void note_failure(Snapshot& snapshot, const std::string& why) {
  snapshot.message = why;
  snapshot.lost_events.reset();
  snapshot.verdict = std::max(snapshot.verdict, Verdict::inconclusive);
  auto& verdicts = snapshot.verdicts;
  auto known = std::ranges::find(verdicts, analysis::kNoLossRule, &VerdictView::rule);
  if (known == verdicts.end()) {
    known = verdicts.insert(known, failed(snapshot, why));
  } else {
    add_reason(*known, why);
  }
  const auto undecided = std::ranges::find_if(
      verdicts, [](const VerdictView& view) { return view.verdict != Verdict::fail; });
  if (undecided < known) std::rotate(undecided, known, std::next(known));
}

}  // namespace cie::live
