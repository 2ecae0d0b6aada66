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
          {"note", evidence.note},
          {"stream", evidence.file.empty() ? Json(nullptr) : Json(evidence.file)},
          {"packet", optional_json(evidence.packet)}};
}

std::string_view state_of(const analysis::Suppression& suppression) {
  return suppression.is_expired ? "expired" : "active";
}

Json json_of(const analysis::SubjectVerdict& subject) {
  Json evidence = Json::array();
  for (const auto& item : subject.evidence) {
    evidence.push_back(json_of(item));
  }
  Json json{{"subject", subject.subject},
            {"verdict", analysis::label(subject.verdict)},
            {"checked", subject.checked},
            {"evidence", std::move(evidence)}};
  if (const auto& suppression = subject.suppression) {
    json["suppression"] = {{"state", state_of(*suppression)},
                           {"reason", suppression->reason},
                           {"expires", suppression->expires},
                           {"place", suppression->place}};
  }
  return json;
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

Json json_of(const analysis::SuppressionReport& report) {
  Json entries = Json::array();
  for (const auto& [suppression, matched] : report.uses) {
    entries.push_back({{"rule", suppression.rule},
                       {"subject", suppression.subject},
                       {"reason", suppression.reason},
                       {"expires", suppression.expires},
                       {"place", suppression.place},
                       {"state", state_of(suppression)},
                       {"matched", matched}});
  }
  return {{"date", report.date}, {"entries", std::move(entries)}};
}

}  // namespace

void write_verify_json(std::ostream& out, const analysis::VerdictReport& verdicts) {
  Json rules = Json::array();
  for (const auto& rule : verdicts.rules) {
    rules.push_back(json_of(rule));
  }
  Json document{{"schema", "cie.verify/1"},
                {"verdict", overall_label(verdicts.verdict)},
                {"rules", std::move(rules)}};
  if (const auto& window = verdicts.window) {
    document["window"] = {{"begin_ns", window->from.ns}, {"end_ns", window->to.ns}};
  }
  if (verdicts.suppressions) document["suppressions"] = json_of(*verdicts.suppressions);
  write_json(out, document);
}

}  // namespace cie::viewer_export
