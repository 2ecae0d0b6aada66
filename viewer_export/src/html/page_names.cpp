#include "page_names.hpp"

#include <cie/analysis/report_rows.hpp>

#include "words/callback_names.hpp"

#include <algorithm>
#include <string>
#include <utility>

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
  return callback == nullptr ? names.in_words(subject.subject) : "callback " + names.of(*callback);
}

}  // namespace

Json page_names(const analysis::AnalysisResult& result) {
  const auto& report = result.report;
  const CallbackNames names(report, {.unicode = true});
  const analysis::ReportRows rows(report);
  Json callbacks = Json::array();
  Json chains = Json::array();
  Json words = Json::object();
  const auto say = [&words](const std::string& text, std::string said) {
    if (text != said) words[text] = std::move(said);
  };
  for (const auto& callback : report.callbacks) {
    callbacks.push_back(names.of(callback));
    say(callback.logical_id, names.of_id(callback.logical_id));
  }
  for (const auto& chain : report.chains)
    chains.push_back(names.of(chain));
  for (const auto& rule : result.verdicts.rules) {
    std::size_t told = 0;
    for (const auto& subject : rule.subjects) {
      if (subject.verdict != rule.verdict || rule.verdict < Verdict::inconclusive) continue;
      if (++told > kMostSubjects) break;
      say(subject.subject, subject_words(subject, rows, names));
      for (std::size_t i = 0; i < std::min(subject.evidence.size(), kMostEvidence); ++i)
        say(subject.evidence[i].note, names.in_words(subject.evidence[i].note));
    }
  }
  return {{"callbacks", std::move(callbacks)},
          {"chains", std::move(chains)},
          {"words", std::move(words)}};
}

}  // namespace cie::viewer_export
