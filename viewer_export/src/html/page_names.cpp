#include "page_names.hpp"

#include <cie/analysis/report_rows.hpp>

#include "text/verify_findings.hpp"
#include "words/callback_names.hpp"
#include "words/note_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace cie::viewer_export {
namespace {

using analysis::SubjectKind;
using analysis::Verdict;

// As many as the page shows (html/findings.js).
constexpr std::size_t kMostSubjects = 100;
constexpr std::size_t kMostEvidence = 3;

std::string subject_words(const analysis::SubjectVerdict& subject, const analysis::ReportRows& rows,
                          const CallbackNames& names) {
  const auto& about = subject.about;
  const auto* callback = about.kind == SubjectKind::callback && about.index
                             ? rows.find(analysis::CallbackIndex{*about.index})
                             : nullptr;
  return callback == nullptr ? names.in_words(subject.name_told_apart())
                             : "callback " + names.of(*callback);
}

// Those of the rule's verdict; of a violated rule the worst first, and last what is suppressed.
std::vector<const analysis::SubjectVerdict*> told_subjects(const Judged& judged,
                                                           const analysis::RuleVerdict& rule) {
  if (rule.verdict == Verdict::fail) return violating_worst_first(judged, rule);
  std::vector<const analysis::SubjectVerdict*> subjects;
  for (const auto& subject : rule.subjects) {
    if (subject.verdict == rule.verdict) subjects.push_back(&subject);
  }
  return subjects;
}

}  // namespace

Json page_names(const analysis::AnalysisResult& result, const SchedulingSpec* spec) {
  const auto& report = result.report;
  const TextStyle style{.unicode = true};
  const VerifyContext context{.spec = spec};
  const Judged judged(result.verdicts, report, context, style);
  const auto& names = judged.names;
  Json callbacks = Json::array();
  Json chains = Json::array();
  std::map<std::string, std::string> words;
  const auto say = [&words](const std::string& text, std::string said) {
    if (text != said) words[text] = std::move(said);
  };
  std::map<std::string, std::string> ordinals;
  for (const auto& callback : report.callbacks) {
    callbacks.push_back(names.of(callback));
    if (auto told = ordinal(callback); !told.empty())
      ordinals[std::to_string(analysis::at(callback.index))] = std::move(told);
    say(callback.logical_id, names.of_id(callback.logical_id));
  }
  for (const auto& chain : report.chains)
    chains.push_back(names.of(chain));
  Json order = Json::object();
  for (const auto& rule : result.verdicts.rules) {
    if (rule.verdict < Verdict::inconclusive) continue;
    auto subjects = told_subjects(judged, rule);
    if (rule.verdict == Verdict::fail) {
      auto& places = order[rule.id] = Json::array();
      for (const auto* subject : subjects)
        places.push_back(subject - rule.subjects.data());
    }
    subjects.resize(std::min(subjects.size(), kMostSubjects));
    for (const auto* subject : subjects) {
      say(subject->name_told_apart(), subject_words(*subject, judged.rows, names));
      for (std::size_t i = 0; i < std::min(subject->evidence.size(), kMostEvidence); ++i) {
        const auto& note = subject->evidence[i].note;
        say(sentence(note), sentence(note, names));
      }
    }
  }
  return {{"callbacks", std::move(callbacks)},
          {"ordinals", object_json(ordinals)},
          {"chains", std::move(chains)},
          {"words", object_json(words)},
          {"order", std::move(order)}};
}

}  // namespace cie::viewer_export
