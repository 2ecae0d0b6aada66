#include <cie/analysis/rule_pages.hpp>
#include <cie/viewer_export/verify_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "json.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"

#include <cstddef>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;

std::string_view kind_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::fail:
      return "fail";
    case Verdict::inconclusive:
      return "open";
    case Verdict::pass:
      return "pass";
    case Verdict::not_applicable:
      break;
  }
  return "notApplicable";
}

// A path as a relative reference of RFC 3986 or a file: URI.
std::string uri_of(std::string_view path) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~/";
  std::string uri = path.starts_with('/') ? "file://" : "";
  for (const char c : path) {
    uri += kPlain.find(c) != std::string_view::npos
               ? std::string(1, c)
               : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

Json rules_json(const analysis::VerdictReport& verdicts) {
  Json rules = Json::array();
  for (const auto& rule : verdicts.rules) {
    Json json{{"id", rule.id}, {"name", rule.name}};
    if (const auto* page = analysis::find_rule_page(rule.id)) {
      json["shortDescription"] = {{"text", page->meaning}};
      json["fullDescription"] = {{"text", page->page}};
      json["help"] = {{"text", page->page}};
    }
    json["defaultConfiguration"] = {{"level", "error"}};
    rules.push_back(std::move(json));
  }
  return rules;
}

Json artifact_location(const analysis::Report& report) {
  return {{"artifactLocation", {{"uri", uri_of(report.trace.paths.front())}}}};
}

// "accepted.yaml:3" as its file and line.
Json location_of(const std::string& place) {
  const auto colon = place.rfind(':');
  const auto line = std::stoi(place.substr(colon + 1));
  return {{"physicalLocation",
           {{"artifactLocation", {{"uri", uri_of(std::string_view(place).substr(0, colon))}}},
            {"region", {{"startLine", line}}}}}};
}

Json suppressions_json(const analysis::SubjectVerdict& subject) {
  Json suppressions = Json::array();
  if (const auto& suppression = subject.suppression) {
    suppressions.push_back({{"kind", "external"},
                            {"status", suppression->is_expired ? "rejected" : "accepted"},
                            {"justification", suppression->reason},
                            {"location", location_of(suppression->place)},
                            {"properties", {{"expires", suppression->expires}}}});
  }
  return suppressions;
}

Json result_json(const analysis::RuleVerdict& rule, std::size_t rule_index,
                 const analysis::SubjectVerdict& subject, const analysis::Report& report) {
  const auto name = subject.subject.empty() ? rule.name : subject.name_told_apart();
  Json location{{"logicalLocations", {{{"fullyQualifiedName", name}}}}};
  if (!report.trace.paths.empty()) location["physicalLocation"] = artifact_location(report);
  Json result{
      {"ruleId", rule.id},
      {"ruleIndex", rule_index},
      {"kind", kind_of(subject.verdict)},
      {"level", subject.verdict == Verdict::fail ? "error" : "none"},
      {"message", {{"text", fmt::format("{}: {}", printable(name), message_of(rule, subject))}}},
      {"locations", {std::move(location)}},
      {"partialFingerprints", {{"cieSubject/v1", fmt::format("{} {}", rule.id, name)}}},
      {"properties", {{"checked", subject.checked}}}};
  Json related = Json::array();
  for (const auto& evidence : subject.evidence) {
    Json item{{"id", related.size() + 1}, {"message", {{"text", evidence_line(evidence, report)}}}};
    if (!report.trace.paths.empty()) item["physicalLocation"] = artifact_location(report);
    related.push_back(std::move(item));
  }
  if (!related.empty()) result["relatedLocations"] = std::move(related);
  return result;
}

}  // namespace

void write_verify_sarif(std::ostream& out, const analysis::VerdictReport& verdicts,
                        const analysis::Report& report) {
  Json results = Json::array();
  for (std::size_t i = 0; i < verdicts.rules.size(); ++i) {
    const auto& rule = verdicts.rules[i];
    for_each_case(rule, [&](const auto& subject) {
      auto result = result_json(rule, i, subject, report);
      // Once one result has the property every result has (SARIF 2.1.0, 3.27.23).
      if (verdicts.suppressions) result["suppressions"] = suppressions_json(subject);
      results.push_back(std::move(result));
    });
  }
  Json driver{{"name", "cie"},
              {"version", tool_version()},
              {"semanticVersion", tool_version()},
              {"rules", rules_json(verdicts)}};
  Json run{{"tool", {{"driver", std::move(driver)}}},
           {"columnKind", "utf16CodeUnits"},
           {"results", std::move(results)}};
  if (const auto& window = verdicts.window) {
    run["properties"] = {{"window", {{"begin_ns", window->from.ns}, {"end_ns", window->to.ns}}}};
  }
  write_json(out, {{"$schema",
                    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/"
                    "sarif-schema-2.1.0.json"},
                   {"version", "2.1.0"},
                   {"runs", Json::array({std::move(run)})}});
}

}  // namespace cie::viewer_export
