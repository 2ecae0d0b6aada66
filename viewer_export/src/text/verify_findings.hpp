// What a screen of `cie verify` tells of the rules that are not kept.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "words/callback_names.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// What reasons and rows rest on.
struct Judged {
  const analysis::VerdictReport& verdicts;
  const analysis::Report& report;
  const VerifyContext& context;
  analysis::ReportRows rows;
  CallbackNames names;

  Judged(const analysis::VerdictReport& v, const analysis::Report& r, const VerifyContext& c,
         const TextStyle& style)
      : verdicts(v), report(r), context(c), rows(r), names(r, style) {}

  // What opens the page, which has no --window, and what to call it.
  std::pair<std::string_view, std::string> look() const {
    return {verdicts.window ? "look (whole recording)" : "look",
            "cie view " + context.view_arguments};
  }
};

// Subjects of a violated rule of which the same is said.
struct FindingRow {
  std::vector<std::string> names;
  std::string detail;
  std::string more;  // where there is room
};

// A violated rule.
struct Finding {
  const analysis::RuleVerdict* rule = nullptr;
  std::size_t violating = 0;     // subjects that count
  std::string subjects;          // "4 of 4 threads"
  std::string_view violation;    // what these did: "ran several callbacks"
  std::vector<FindingRow> rows;  // the worst first, where there is a measure of it
  std::string order;             // by what, where the rows' numbers do not show it; may be empty
  std::string worst;             // of the first row's subject: where its time went; may be empty
};

// A reason for which something is undecided, and all that it concerns.
struct Doubt {
  std::string reason;              // "e.g. " and one of them, if it differs between them
  std::vector<std::string> rules;  // their ids
  std::string subjects;            // "11 threads"
  std::size_t count = 0;           // of subjects
};

// "app.yaml" of a path: places in a spec are told by it.
std::string_view file_name(std::string_view path);
// What is told of one violating subject: "2 callbacks: plan timer 1 ns, drive <- /pose".
std::string told_of_violation(const Judged& judged, const analysis::RuleVerdict& rule,
                              const analysis::SubjectVerdict& subject);
// All violating subjects of a rule, the worst first where there is a measure of it; last those that
// are suppressed.
std::vector<const analysis::SubjectVerdict*> violating_worst_first(
    const Judged& judged, const analysis::RuleVerdict& rule);
// The gravest first: the mapping, deadlines, then as the contract has them.
std::vector<Finding> findings_of(const Judged& judged);
// The most frequent first.
std::vector<Doubt> doubts_of(const Judged& judged);

// "S3 by read-back, S5 announced only": rules that pass, and on what. Empty: all rest on all that they ask for.
std::string grounds_of_passes(const analysis::VerdictReport& verdicts);
// It passes although it ran with a raised priority, which may be inherited.
bool is_perhaps_inherited(const analysis::SubjectVerdict& subject);
// "S3 by read-back: 2 threads had raised priorities, perhaps inherited"; empty: none had.
std::string raised_priorities(const analysis::VerdictReport& verdicts);
// "no rule judges the parameters of 2 callbacks, which have no own thread"; empty: the spec has none.
std::string unjudged_parameters(const analysis::VerdictReport& verdicts);

// "26 of 26 callbacks share threads": the gravest fact, without the verdict's word.
std::string gravest_fact(const Judged& judged, const std::vector<Finding>& findings);
// "8 of 8 callbacks that ran had a thread of their own", or what was seen instead.
std::string isolation_fact(const analysis::Report& report);
// The same where rules M2 and M3 may not decide it: "as far as recorded, 28 of 28 callbacks …".
std::string isolation_seen(const Judged& judged);
// What to do about a violated rule; empty where its page says nothing.
std::string remedy_of(const Judged& judged, const Finding& finding);

}  // namespace cie::viewer_export
