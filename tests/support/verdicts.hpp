// How tests ask for verdicts.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/sentences.hpp>

#include "support/trace_text.hpp"

#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {
inline void PrintTo(Verdict verdict, std::ostream* out) { *out << label(verdict); }
}  // namespace cie::analysis

namespace cie::test {

// The verdicts on a trace written as text, with a spec written as text (empty: none).
struct Verified {
  analysis::AnalysisResult result;

  explicit Verified(const TextTrace& trace, std::string_view spec_text = {},
                    analysis::AnalysisOptions options = {}) {
    if (spec_text.empty()) {
      result = analyze(trace, options);
      return;
    }
    const auto spec = SchedulingSpec::parse(spec_text, "spec.yaml");
    options.spec = &spec;
    result = analyze(trace, options);
  }
  explicit Verified(std::string_view trace_text, std::string_view spec_text = {})
      : Verified(trace_of(trace_text), spec_text) {}
  // With what its recorder says of it.
  Verified(const TextTrace& trace, const std::vector<analysis::Recording>& recordings,
           const SchedulingSpec* spec = nullptr) {
    analysis::AnalysisOptions options;
    options.spec = spec;
    analysis::Analyzer analyzer(options);
    analyzer.add(recordings);
    for (const auto& event : trace.events)
      analyzer.consume(event);
    result = analyzer.finish();
  }

  const analysis::RuleVerdict& rule(std::string_view id) const {
    for (const auto& rule : result.verdicts.rules) {
      if (rule.id == id) return rule;
    }
    throw std::out_of_range("no rule " + std::string(id));
  }
  analysis::Verdict operator[](std::string_view id) const { return rule(id).verdict; }
  // The verdict on one subject; not applicable if the rule does not name it.
  analysis::SubjectVerdict on(std::string_view id, std::string_view subject) const {
    for (const auto& verdict : rule(id).subjects) {
      if (verdict.subject == subject) return verdict;
    }
    return {};
  }
  analysis::Verdict of(std::string_view id, std::string_view subject) const {
    return on(id, subject).verdict;
  }
  // Times and notes of the evidence, one line each: "12 callback_start fusion started …".
  std::string evidence(std::string_view id, std::string_view subject) const {
    std::string text;
    for (const auto& item : on(id, subject).evidence) {
      text += (item.time ? std::to_string(item.time->ns) : "?") + ' ' + item.event + ' ' +
              viewer_export::sentence(item.note) + '\n';
    }
    return text;
  }
};

}  // namespace cie::test
