// The first lines of a screen: the gravest fact, and what whoever relies on it has to know.
#pragma once

#include "screen.hpp"
#include "verify_findings.hpp"
#include "words/text_layout.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

// Borrows all that it is made of.
class Headline {
 public:
  Headline(const Judged& judged, const std::vector<Finding>& findings, const TextStyle& style)
      : judged_(judged), findings_(findings), style_(style) {}

  analysis::Verdict verdict() const;
  // Rules with it, without those that would have another verdict if nothing were suppressed.
  std::vector<std::string> rules_with(analysis::Verdict verdict) const;
  // Rules with verdicts that are suppressed.
  std::vector<std::string> rules_suppressed() const;
  // How many verdicts are.
  std::size_t suppressed() const;
  // "26 of 26 callbacks share threads".
  std::string fact() const;
  // "FAIL  run1: 26 of 26 callbacks share threads".
  Lines lines() const;
  // The same on one line, whatever its length.
  std::string line() const;
  // Without the verdict: what was seen.
  Lines lines_of(const std::string& fact) const;

 private:
  Look look() const;
  std::string word() const;
  std::string title() const;

  const Judged& judged_;
  const std::vector<Finding>& findings_;
  const TextStyle& style_;
};

// "1558 instances, nothing lost, 2 cut or never ended"; "1553 instances, 5 missing": what the trace shows to be
// missing is told whether or not the tracer counted it.
std::string counts_of_runs(const analysis::Report& report);
// "spec: 2 of 5 callbacks not in the recording: /a/plam@Timer(20000000) (app.yaml:2), …", with the ids
// as the spec has them (also "/a/*", if no callback of that node was seen); nothing without such.
Lines unseen_of_spec(const Judged& judged, const TextStyle& style);
// What else there is to know, four sentences at most: the window, suppressions, the recorder.
Lines remarks(const Judged& judged, Lines before, const TextStyle& style);

}  // namespace cie::viewer_export
