// What a rule would have judged, had it been recorded: the trace is a subject that needs it.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/analysis/verdict.hpp>

#include "rule.hpp"
#include "rule_context.hpp"

#include <optional>
#include <vector>

namespace cie::analysis {

class UnseenSubjects {
 public:
  // `context` is borrowed.
  explicit UnseenSubjects(const RuleContext& context);

  // To what the rule says of its subjects.
  void add(const Rule& rule, std::vector<SubjectVerdict>& subjects) const;

 private:
  void add_missing_part(const Rule& rule, std::vector<SubjectVerdict>& subjects) const;
  // What manifests say was recorded and is not here, and what recorders say they did not write. That is no fault of the
  // traces that are here.
  const std::optional<Note>& missing_part(const Rule& rule) const;

  const RuleContext& context_;
  std::optional<Note> missing_of_user_;
  std::optional<Note> missing_of_kernel_;
  std::optional<Note> missing_of_recorder_;
};

}  // namespace cie::analysis
