#include <cie/analysis/rule_pages.hpp>
#include <cie/viewer_export/verify_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "tables/report_tables.hpp"
#include "verify_findings.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Evidence;
using analysis::Timestamp;
using analysis::Verdict;

// How much of the trace the suggested command shows on either side of the evidence.
constexpr std::int64_t kMarginNs = 1'000'000;

Look look_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::fail:
      return Look::bad;
    case Verdict::inconclusive:
      return Look::doubtful;
    case Verdict::pass:
      return Look::good;
    case Verdict::not_applicable:
      break;
  }
  return Look::faint;
}

// A window is of one clock; `cie events` refuses it where machines have their own.
bool is_of_one_clock(const analysis::Report& report) {
  return report.hosts.size() < 2 ||
         std::ranges::all_of(report.hosts, [](const analysis::HostReport& host) {
           return host.clock_offset_ns && host.shift == analysis::Duration{};
         });
}

// Shows the events around the evidence; all events, where no time of it is known, or no window has it.
std::string events_command(const std::vector<Evidence>& evidence, const analysis::Report& report,
                           const std::string& reader_arguments) {
  std::optional<Timestamp> first;
  std::optional<Timestamp> last;
  for (const auto& item : evidence) {
    if (!item.time) continue;
    first = std::min(first.value_or(*item.time), *item.time);
    last = std::max(last.value_or(*item.time), *item.time);
  }
  std::string command = "cie events";
  for (const auto& path : report.trace.paths)
    command += " " + printable(shell_quoted(path));
  if (!reader_arguments.empty()) command += " " + reader_arguments;
  std::int64_t from = 0;
  std::int64_t to = 0;
  const bool is_window = first && is_of_one_clock(report) &&
                         !__builtin_sub_overflow(first->ns, kMarginNs, &from) &&
                         !__builtin_add_overflow(last->ns, kMarginNs, &to) && to >= 0;
  if (is_window) command += fmt::format(" --window {}..{}", std::max<std::int64_t>(from, 0), to);
  return command;
}

// What the rule demands and why, and how to mend the system; or, if undecided, what decides it: for
// who knows nothing of it.
std::string about(const analysis::RuleVerdict& rule, Verdict verdict,
                  const analysis::Report& report, const TextStyle& style) {
  const auto* page = analysis::find_rule_page(rule.id);
  if (page == nullptr) return {};
  const auto sentence = [](std::string_view begin, std::string_view rest) {
    return std::string(begin).append(rest);
  };
  std::vector<std::string> paragraphs{sentence("The rule: ", page->meaning)};
  if (verdict == Verdict::inconclusive) {
    paragraphs.push_back(sentence(analysis::kInconclusiveWhen, page->inconclusive_when));
  } else {
    const bool is_of_rclcpp = executor_of(rule, report) == ExecutorSeen::none;
    paragraphs.push_back(sentence(analysis::kWhyItMatters, page->why_it_matters));
    paragraphs.push_back(sentence(analysis::kRemedy, remedy_of_rule(rule.id, is_of_rclcpp)));
  }
  std::string text;
  for (const auto& paragraph : paragraphs) {
    for (const auto& part : wrap(paragraph, style.columns - 4))
      text += "    " + part + "\n";
  }
  return text;
}

std::string finding(const analysis::RuleVerdict& rule, const analysis::SubjectVerdict& subject,
                    const analysis::Report& report, const std::string& reader_arguments,
                    const TextStyle& style) {
  constexpr std::size_t kIndent = 2;
  const std::string suppressed = subject.is_suppressed() ? "SUPPRESSED " : "";
  const auto label = analysis::label(subject.verdict);
  const auto checked =
      subject.checked > 0 ? fmt::format(" ({} checked)", subject.checked) : std::string();
  const auto title = filled(fmt::format("{}{}  {} {}: {}{}", suppressed, label, rule.id, rule.name,
                                        printable(subject.name_told_apart()), checked),
                            style.columns, kIndent + 2);
  auto text = paint(suppressed, Look::faint, style) +
              paint(label, look_of(subject.verdict), style) +
              title.substr(suppressed.size() + label.size());
  if (subject.suppression)
    text += filled("    " + words_of(*subject.suppression), style.columns, kIndent);
  for (const auto& evidence : subject.evidence)
    text += filled("    " + evidence_line(evidence, report), style.columns, kIndent);
  if (!subject.evidence.empty()) {
    text += "    " +
            paint(events_command(subject.evidence, report, reader_arguments), Look::faint, style) +
            "\n";
  }
  return text;
}

// Undecided for the same reason, which is said once.
bool says_the_same(const analysis::SubjectVerdict& one, const analysis::SubjectVerdict& other) {
  const auto is_same = [](const Evidence& a, const Evidence& b) {
    return std::tie(a.event, a.time, a.pid, a.tid, a.note) ==
           std::tie(b.event, b.time, b.pid, b.tid, b.note);
  };
  return one.verdict == Verdict::inconclusive && other.verdict == one.verdict &&
         one.name_told_apart() == other.name_told_apart() && !one.suppression &&
         !other.suppression && !one.evidence.empty() &&
         std::ranges::equal(one.evidence, other.evidence, is_same);
}

// Rules that say the same of the same subject, in their order.
std::vector<std::string> rules_that_say(const analysis::VerdictReport& verdicts,
                                        const analysis::SubjectVerdict& said) {
  std::vector<std::string> ids;
  for (const auto& rule : verdicts.rules) {
    const auto says = [&said](const auto& subject) { return says_the_same(said, subject); };
    if (std::ranges::any_of(rule.subjects, says)) ids.push_back(rule.id);
  }
  return ids;
}

std::string headline(const analysis::VerdictReport& verdicts, const TextStyle& style) {
  std::array<std::string, 4> ids;
  std::string suppressed;
  for (const auto& rule : verdicts.rules) {
    const auto counted = analysis::counted_verdict(rule);
    const bool is_suppressed = counted < Verdict::inconclusive && rule.verdict > Verdict::pass;
    auto& list = is_suppressed ? suppressed : ids.at(static_cast<std::size_t>(counted));
    list += (list.empty() ? "" : " ") + rule.id;
  }
  const auto overall = std::max(verdicts.verdict, Verdict::pass);
  std::string text =
      paint(fmt::format("Verdict: {}", analysis::label(overall)), look_of(overall), style) + "\n";
  const auto add = [&](std::string_view title, const std::string& list) {
    for (const auto& line : wrap(list, style.columns - 18)) {
      text += fmt::format("  {:<16}{}\n", title, line);
      title = "";
    }
  };
  const auto with = [&ids](Verdict verdict) { return ids.at(static_cast<std::size_t>(verdict)); };
  add("violated", with(Verdict::fail));
  add("undecided", with(Verdict::inconclusive));
  add("suppressed", suppressed);
  add("passed", with(Verdict::pass));
  add("of these", grounds_of_passes(verdicts));
  add("not applicable", with(Verdict::not_applicable));
  return text;
}

// "the same for M3, M4": what else the finding before undecides.
std::string also(const std::vector<std::string>& same, const TextStyle& style) {
  std::string list = "the same for";
  for (std::size_t i = 1; i < same.size(); ++i)
    list += (i == 1 ? " " : ", ") + same[i];
  std::string text;
  for (const auto& line : wrap(list, style.columns - 4))
    text += "    " + line + "\n";
  return text;
}

// "2 instances ended by an exception: 2 of /car/lidar@Timer(100000000)".
std::string exceptions(const analysis::Report& report) {
  constexpr std::size_t kMostNodes = 3;
  std::uint64_t all = 0;
  std::size_t callbacks = 0;
  std::string names;
  for (const auto& callback : report.callbacks) {
    const auto count = callback.exceptions.value_or(0);
    if (count == 0) continue;
    all += count;
    if (++callbacks > kMostNodes) continue;
    names += fmt::format("{}{} of {}", names.empty() ? "" : ", ", count,
                         callback_title(report, callback));
  }
  if (all == 0) return {};
  if (callbacks > kMostNodes) names += fmt::format(" and of {} more", callbacks - kMostNodes);
  return fmt::format("{} ended by an exception: {}", counted(all, "instance"), names);
}

std::string summary(const analysis::VerdictReport& verdicts, const analysis::Report& report,
                    const VerifyContext& context, const TextStyle& style) {
  std::uint64_t instances = 0;
  std::uint64_t incomplete = 0;
  for (const auto& callback : report.callbacks) {
    instances += callback.instances;
    incomplete += callback.partly_seen();
  }
  std::string text;
  const auto add = [&text, &style](const std::string& line) {
    constexpr std::size_t kIndent = 2;
    if (!line.empty()) text += filled(line, style.columns, kIndent);
  };
  add(fmt::format("{} of {} in {} checked; {} cut by an edge of the trace or never ended",
                  counted(instances, "instance"), counted(report.callbacks.size(), "callback"),
                  counted(report.processes.size(), "process"), incomplete));
  add(exceptions(report));
  for (const auto& defect : report.defects) {
    if (defect.severity != analysis::Severity::info) {
      add(defects_of_trace(fmt::format("{} x {}", analysis::label(defect.kind), defect.count)) +
          ": " + printable(defect.advice));
    }
  }
  for (const auto& recording : report.recordings) {
    for (const auto& sentence : sentences_of(recording))
      add(fmt::format("recording {}: {}", printable(recording.path), sentence));
  }
  if (const auto& window = verdicts.window) {
    add("judged is " + window_words(*window));
  }
  for (const auto& sentence : useless_suppressions(verdicts))
    add(sentence);
  add(context.spec_name.empty()
          ? std::string("no --spec was given: rules that compare with one are not applicable")
          : fmt::format("spec {} sha256 {}", printable(context.spec_name), context.spec_sha256));
  add(fmt::format("cie {}; cie verify --explain ID tells what a rule means", tool_version()));
  return text;
}

}  // namespace

void write_verify_text(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report, const VerifyContext& context,
                       const TextStyle& style) {
  out << headline(verdicts, style) << '\n';
  const auto write = [&](Verdict verdict, bool is_suppressed) {
    for (const auto& rule : verdicts.rules) {
      bool is_told = is_suppressed;
      for (const auto& subject : rule.subjects) {
        if (subject.verdict != verdict || subject.is_suppressed() != is_suppressed) continue;
        const auto same = rules_that_say(verdicts, subject);
        if (!same.empty() && same.front() != rule.id) continue;
        out << finding(rule, subject, report, context.reader_arguments, style);
        if (same.size() > 1) out << also(same, style);
        if (!is_told) out << about(rule, verdict, report, style);
        is_told = true;
        out << '\n';
      }
    }
  };
  for (const bool is_suppressed : {false, true}) {
    write(Verdict::fail, is_suppressed);
    write(Verdict::inconclusive, is_suppressed);
  }
  // Who doubts that these were inherited finds when they were.
  for (const auto& rule : verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      if (is_perhaps_inherited(subject))
        out << finding(rule, subject, report, context.reader_arguments, style) << '\n';
    }
  }
  out << summary(verdicts, report, context, style);
}

}  // namespace cie::viewer_export
