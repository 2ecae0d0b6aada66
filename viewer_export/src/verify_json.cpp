#include <cie/viewer_export/verify_writers.hpp>

#include "json.hpp"

namespace cie::viewer_export {
namespace {

// A program without verdict-bearing rules passed: the contract knows three overall verdicts.
std::string_view overall_label(analysis::Verdict verdict) {
  return analysis::label(verdict == analysis::Verdict::not_applicable ? analysis::Verdict::pass
                                                                      : verdict);
}

Json json_of(const analysis::Evidence& evidence) {
  return {{"event", evidence.event},
          {"time_ns", evidence.time.ns},
          {"cpu", optional_json(evidence.cpu)},
          {"pid", optional_json(evidence.pid)},
          {"tid", optional_json(evidence.tid)},
          {"note", evidence.note}};
}

Json json_of(const analysis::SubjectVerdict& subject) {
  Json evidence = Json::array();
  for (const auto& item : subject.evidence) {
    evidence.push_back(json_of(item));
  }
  return {{"subject", subject.subject},
          {"verdict", analysis::label(subject.verdict)},
          {"checked", subject.checked},
          {"evidence", std::move(evidence)}};
}

Json json_of(const analysis::RuleVerdict& rule) {
  Json subjects = Json::array();
  for (const auto& subject : rule.subjects) {
    subjects.push_back(json_of(subject));
  }
  return {{"id", rule.id},
          {"name", rule.name},
          {"verdict", analysis::label(rule.verdict)},
          {"subjects", std::move(subjects)}};
}

}  // namespace

void write_verify_json(std::ostream& out, const analysis::VerdictReport& verdicts) {
  Json rules = Json::array();
  for (const auto& rule : verdicts.rules) {
    rules.push_back(json_of(rule));
  }
  write_json(out, {{"schema", "cie.verify/1"},
                   {"verdict", overall_label(verdicts.verdict)},
                   {"rules", std::move(rules)}});
}

}  // namespace cie::viewer_export
