#include <cie/viewer_export/verify_writers.hpp>

#include "words/verify_words.hpp"
#include "xml.hpp"

#include <cstddef>
#include <string>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;

struct Counts {
  std::size_t tests = 0;
  std::size_t failures = 0;
  std::size_t errors = 0;
  std::size_t skipped = 0;

  void add(const analysis::SubjectVerdict& subject) {
    ++tests;
    if (subject.is_suppressed() || subject.verdict == Verdict::not_applicable) {
      ++skipped;
      return;
    }
    failures += subject.verdict == Verdict::fail ? 1U : 0U;
    errors += subject.verdict == Verdict::inconclusive ? 1U : 0U;
  }
  std::string attributes() const {
    return fmt::format(R"(tests="{}" failures="{}" errors="{}" skipped="{}")", tests, failures,
                       errors, skipped);
  }
};

std::string window_of(const analysis::VerdictReport& verdicts) {
  if (!verdicts.window) return {};
  return fmt::format(" of the window {}..{} ns", verdicts.window->from.ns, verdicts.window->to.ns);
}

Counts counts_of(const analysis::RuleVerdict& rule) {
  Counts counts;
  for_each_case(rule, [&counts](const auto& subject) { counts.add(subject); });
  return counts;
}

void write_outcome(std::ostream& out, const analysis::RuleVerdict& rule,
                   const analysis::SubjectVerdict& subject, const analysis::Report& report) {
  if (subject.verdict == Verdict::not_applicable) {
    out << "      <skipped message=\"not applicable\"/>\n";
    return;
  }
  const std::string element = subject.verdict == Verdict::fail ? "failure" : "error";
  std::string text;
  for (const auto& evidence : subject.evidence)
    text += evidence_line(evidence, report) + '\n';
  if (subject.suppression) text += words_of(*subject.suppression) + '\n';
  if (subject.is_suppressed()) {
    out << fmt::format("      <skipped message=\"{} {}\"/>\n      <system-out>{}</system-out>\n",
                       analysis::label(subject.verdict),
                       xml_escaped(words_of(*subject.suppression)), xml_escaped(text));
    return;
  }
  out << fmt::format("      <{0} type=\"{1}\" message=\"{2}\">{3}</{0}>\n", element,
                     analysis::label(subject.verdict), xml_escaped(message_of(rule, subject)),
                     xml_escaped(text));
}

void write_case(std::ostream& out, const analysis::RuleVerdict& rule,
                const analysis::SubjectVerdict& subject, const analysis::Report& report) {
  out << fmt::format("    <testcase classname=\"cie.verify.{}\" name=\"{}\"", rule.id,
                     xml_escaped(subject.subject.empty() ? rule.name : subject.name_told_apart()));
  if (subject.verdict == Verdict::pass) {
    out << "/>\n";
    return;
  }
  out << ">\n";
  write_outcome(out, rule, subject, report);
  out << "    </testcase>\n";
}

}  // namespace

void write_verify_junit(std::ostream& out, const analysis::VerdictReport& verdicts,
                        const analysis::Report& report) {
  Counts all;
  for (const auto& rule : verdicts.rules) {
    const auto counts = counts_of(rule);
    all.tests += counts.tests;
    all.failures += counts.failures;
    all.errors += counts.errors;
    all.skipped += counts.skipped;
  }
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      << fmt::format("<testsuites name=\"cie verify{}\" {}>\n", window_of(verdicts),
                     all.attributes());
  for (const auto& rule : verdicts.rules) {
    out << fmt::format("  <testsuite name=\"{} {}\" {}>\n", rule.id, xml_escaped(rule.name),
                       counts_of(rule).attributes());
    for_each_case(rule, [&](const auto& subject) { write_case(out, rule, subject, report); });
    out << "  </testsuite>\n";
  }
  out << "</testsuites>\n";
}

}  // namespace cie::viewer_export
