#include <cie/viewer_export/verify_writers.hpp>

#include "json/json.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"

#include <cstddef>
#include <string>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;

// Text in which "#" begins no directive.
std::string tap_escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '#' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::string description(const analysis::RuleVerdict& rule, std::string_view subject) {
  std::string text = fmt::format("{} {}", rule.id, rule.name);
  if (!subject.empty()) text += fmt::format(": {}", printable(subject));
  return tap_escaped(text);
}

// What TAP calls a test that is known to fail is a TODO: "not ok", and not counted.
std::string directive(const analysis::SubjectVerdict& subject) {
  if (subject.is_suppressed()) return " # TODO " + tap_escaped(words_of(*subject.suppression));
  return subject.verdict == Verdict::not_applicable ? " # SKIP not applicable" : "";
}

// Strings of JSON are strings of YAML.
void write_diagnostics(std::ostream& out, const analysis::RuleVerdict& rule,
                       const analysis::SubjectVerdict& subject, const analysis::Report& report) {
  out << "  ---\n"
      << fmt::format("  message: {}\n", json_string(message_of(rule, subject)))
      << fmt::format("  severity: {}\n",
                     subject.verdict == Verdict::fail ? "fail" : "inconclusive");
  if (subject.suppression) {
    out << fmt::format("  suppression: {}\n", json_string(words_of(*subject.suppression)));
  }
  if (!subject.evidence.empty()) out << "  evidence:\n";
  for (const auto& evidence : subject.evidence)
    out << fmt::format("    - {}\n", json_string(evidence_line(evidence, report)));
  out << "  ...\n";
}

}  // namespace

void write_verify_tap(std::ostream& out, const analysis::VerdictReport& verdicts,
                      const analysis::Report& report) {
  std::size_t count = 0;
  for (const auto& rule : verdicts.rules)
    for_each_case(rule, [&count](const auto&) { ++count; });
  out << fmt::format("TAP version 13\n1..{}\n", count);
  if (const auto& window = verdicts.window) {
    out << fmt::format("# only the window {}..{} ns is judged\n", window->from.ns, window->to.ns);
  }
  std::size_t number = 0;
  const auto write = [&](const analysis::RuleVerdict& rule,
                         const analysis::SubjectVerdict& subject) {
    const bool is_ok = subject.verdict < Verdict::inconclusive;
    out << fmt::format("{} {} - {}{}\n", is_ok ? "ok" : "not ok", ++number,
                       description(rule, subject.name_told_apart()), directive(subject));
    if (!is_ok) write_diagnostics(out, rule, subject, report);
  };
  for (const auto& rule : verdicts.rules)
    for_each_case(rule, [&](const auto& subject) { write(rule, subject); });
}

}  // namespace cie::viewer_export
