// What every format of `cie verify` says in the same words.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/verdict.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace cie::viewer_export {

// "at 12 ns (3 ns into the trace)  callback_start  cpu 0  pid 1  tid 2  what it shows", printable.
std::string evidence_line(const analysis::Evidence& evidence, const analysis::Report& report);

// The first evidence's note; the verdict if there is none.
std::string headline_of(const analysis::SubjectVerdict& subject);
// Notes that tell how the subject violates the rule: of the two events of an instance, the end has all.
// Borrowed from the subject.
std::vector<const analysis::Note*> main_notes(std::string_view rule,
                                              const analysis::SubjectVerdict& subject);
// "3 of 8 threads" "ran several callbacks": what the subjects of a violated rule did.
std::string_view violation_of(std::string_view rule);
// For formats that have room for one line: "missed deadlines: seq 4 ends, …" of a violation, else the
// first note.
std::string message_of(const analysis::RuleVerdict& rule, const analysis::SubjectVerdict& subject);

// "suppressed until 2026-12-31", or "suppression expired after …".
std::string term_of(const analysis::Suppression& suppression);

// "suppressed until 2026-12-31 (accepted.yaml:3): the reason", or "suppression expired after …".
std::string words_of(const analysis::Suppression& suppression);

// Entries that change nothing any more: whoever reads the file must not believe otherwise.
std::vector<std::string> useless_suppressions(const analysis::VerdictReport& verdicts);

// Whether the verdict is about a thread that an isolated executor made for a callback or its group, or
// about what ran on one. Other executors of its process claim nothing of theirs.
bool is_of_isolated_executor(const analysis::SubjectVerdict& subject,
                             const analysis::ReportRows& rows);

// The executor of cie that ran what violates a rule; none where none told of itself, as those of
// rclcpp.
enum class ExecutorSeen : std::uint8_t { none, isolated, other };
ExecutorSeen executor_of(const analysis::RuleVerdict& rule, const analysis::Report& report);

// Of a rule's page; that of an application of rclcpp where the page has one. Empty: there is no such
// rule.
std::string_view remedy_of_rule(std::string_view rule, bool is_of_rclcpp);

// What to do where threads did not get their parameters because the kernel refused all of them with one errno.
// Empty: it did not, or no errno tells more than the rule's page.
std::string_view remedy_of_refusal(const analysis::RuleVerdict& rule);

// "defects of the trace (what they hide stays undecided): seq-gaps x 5" of their names: no defect
// changes a verdict, it leaves open what rests on what is missing.
std::string defects_of_trace(std::string_view names);

// Callbacks, by their numbers, that violate the rule.
std::unordered_set<std::uint32_t> callbacks_violating(const analysis::VerdictReport& verdicts,
                                                      std::string_view rule);

// Of a violated rule: the largest are told first, and equal ones keep their order.
int gravity_of(std::string_view rule);

// Without a scheduling spec the rule does not apply.
bool needs_spec(std::string_view rule);

// The first evidence of its subjects that says why: see RulePage::main_evidence.
std::size_t main_evidence_of(std::string_view rule);

// Calls visit() with every subject of a rule; with one that has no name if the rule has none.
template <typename Visit>
void for_each_case(const analysis::RuleVerdict& rule, const Visit& visit) {
  for (const auto& subject : rule.subjects)
    visit(subject);
  if (!rule.subjects.empty()) return;
  analysis::SubjectVerdict itself;
  itself.verdict = rule.verdict;
  visit(itself);
}

}  // namespace cie::viewer_export
