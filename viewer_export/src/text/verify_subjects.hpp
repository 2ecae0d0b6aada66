// What the screens of `cie verify` ask of the subjects of a rule.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include "verify_findings.hpp"

#include <algorithm>

namespace cie::viewer_export {

// It has that verdict, and is not suppressed.
inline bool counts(const analysis::SubjectVerdict& subject, analysis::Verdict verdict) {
  return subject.verdict == verdict && !subject.is_suppressed();
}

// What it is about, in the report; null: another kind of subject, or it has no row.
inline const analysis::CallbackReport* reported_callback(const Judged& judged,
                                                         const analysis::SubjectVerdict& subject) {
  if (subject.about.kind != analysis::SubjectKind::callback || !subject.about.index) return nullptr;
  return judged.rows.find(analysis::CallbackIndex{*subject.about.index});
}
inline const analysis::ThreadReport* reported_thread(const Judged& judged,
                                                     const analysis::SubjectVerdict& subject) {
  if (subject.about.kind != analysis::SubjectKind::thread || !subject.about.index) return nullptr;
  return judged.rows.find(analysis::ThreadIndex{*subject.about.index});
}

// Violating subjects of M1 that the trace names were registered; of others the id is in the spec alone.
inline bool are_all_registered(const analysis::RuleVerdict& rule) {
  return std::ranges::none_of(rule.subjects, [](const analysis::SubjectVerdict& subject) {
    return counts(subject, analysis::Verdict::fail) && !subject.about.index;
  });
}

}  // namespace cie::viewer_export
