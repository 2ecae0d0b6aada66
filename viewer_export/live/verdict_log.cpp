#include "verdict_log.hpp"

#include "words/note_words.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <tuple>

namespace cie::live {
namespace {

using analysis::SubjectVerdict;
using analysis::Verdict;

std::string note_of(const SubjectVerdict& verdict) {
  if (verdict.evidence.empty()) return {};
  const auto& first = verdict.evidence.front();
  const auto note = viewer_export::sentence(first.note);
  return first.event.empty() ? note : first.event + ": " + note;
}

std::string sentence_of(const analysis::RuleVerdict& rule, const SubjectVerdict& verdict,
                        const VerdictLog::Telling& tell) {
  auto subject = verdict.name_told_apart();
  if (tell && verdict.verdict == Verdict::fail) {
    if (const auto told = tell(rule, verdict); !told.empty()) return subject + ": " + told;
  }
  const auto at = viewer_export::main_evidence_of(rule.id);
  const auto& all = verdict.evidence;
  if (all.empty()) return subject;
  const auto& note = (at < all.size() ? all[at] : all.front()).note;
  return subject + ": " + viewer_export::sentence_with_units(note);
}

}  // namespace

VerdictKey verdict_key(const std::string& rule, const analysis::Subject& about,
                       const std::string& subject) {
  return {rule, about.kind, about.index, about.index ? std::string() : subject};
}

VerdictLog::Noted VerdictLog::note(const analysis::VerdictReport& verdicts, analysis::Timestamp now,
                                   const Telling& tell) {
  Noted noted;
  ++round_;
  for (const auto& rule : verdicts.rules) {
    const auto violations =
        std::ranges::count(rule.subjects, Verdict::fail, &SubjectVerdict::verdict);
    if (violations > 0) {
      noted.violations.push_back(
          {.rule = rule.id, .name = rule.name, .subjects = static_cast<std::uint64_t>(violations)});
    }
    for (const auto& subject : rule.subjects) {
      auto& known = known_[verdict_key(rule.id, subject.about, subject.subject)];
      const auto before = known.verdict;
      const bool is_first = known.round == 0;
      known.round = round_;
      if (is_first || before != subject.verdict) known.since_ns = now.ns;
      known.verdict = subject.verdict;
      const auto is_violation = [](Verdict verdict) { return verdict == Verdict::fail; };
      if (before != subject.verdict && (is_violation(before) || is_violation(subject.verdict))) {
        noted.changes.push_back({.time_ns = now.ns,
                                 .rule = rule.id,
                                 .name = rule.name,
                                 .about = subject.about,
                                 .subject = subject.name_told_apart(),
                                 .from = before,
                                 .to = subject.verdict,
                                 .note = note_of(subject),
                                 .says = sentence_of(rule, subject, tell)});
      }
      if (subject.verdict < Verdict::inconclusive) continue;
      noted.current.push_back({.rule = rule.id,
                               .name = rule.name,
                               .about = subject.about,
                               .subject = subject.name_told_apart(),
                               .verdict = subject.verdict,
                               .since_ns = known.since_ns,
                               .note = note_of(subject),
                               .says = sentence_of(rule, subject, tell)});
    }
  }
  // Subjects that are no longer judged need not be remembered.
  std::erase_if(known_, [this](const auto& entry) { return entry.second.round != round_; });
  std::ranges::stable_sort(noted.current, [](const VerdictView& a, const VerdictView& b) {
    const auto gravity = [](const VerdictView& v) { return viewer_export::gravity_of(v.rule); };
    return a.verdict != b.verdict ? a.verdict > b.verdict : gravity(a) > gravity(b);
  });
  std::ranges::stable_sort(noted.violations, std::ranges::greater{}, [](const RuleViolations& v) {
    return viewer_export::gravity_of(v.rule);
  });
  if (noted.current.size() > kMaxListed) {
    noted.left_out = noted.current.size() - kMaxListed;
    noted.current.resize(kMaxListed);
  }
  return noted;
}

}  // namespace cie::live
