#include "verify_words.hpp"

#include <cie/analysis/rule_pages.hpp>

#include "note_words.hpp"
#include "text_layout.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <variant>

#include <fmt/format.h>

namespace cie::viewer_export {

namespace {

// "  [kernel/sched_0 packet 3]".
std::string place_of(const analysis::Evidence& evidence) {
  if (evidence.file.empty()) return {};
  const auto packet = evidence.packet ? fmt::format(" packet {}", *evidence.packet) : "";
  return fmt::format("  [{}{}]", printable(evidence.file), packet);
}

// What became of the verdicts of an entry that has expired.
std::string after_expiry(const analysis::SuppressionUse& use) {
  if (use.matched == 0) return " and is unused: nothing it names is violated or undecided";
  if (use.counting == 0) return " and is not needed: other entries suppress what it names";
  const auto* const count = use.counting == 1 ? "counts" : "count";
  if (use.counting == use.matched)
    return fmt::format(": its verdict{} {} again", use.counting == 1 ? "" : "s", count);
  return fmt::format(": {} of its {} verdicts {} again", use.counting, use.matched, count);
}

}  // namespace

namespace {

// "at 12 ns (3 ns into the trace)".
std::string time_words(const analysis::Evidence& evidence, const analysis::Report& report) {
  if (!evidence.time) return "at an unknown time";
  auto at = fmt::format("at {} ns", evidence.time->ns);
  const auto begin = report.trace.zero();
  // Of several hosts the begin is a time of one of their clocks.
  if (!begin || report.trace.hosts.size() > 1) return at;
  return fmt::format("{} ({} into the trace)", at, format_duration((*evidence.time - *begin).ns));
}

}  // namespace

std::string evidence_line(const analysis::Evidence& evidence, const analysis::Report& report) {
  const auto id = [](std::string_view name, const auto& value) {
    return value ? fmt::format("  {} {}", name, *value) : std::string{};
  };
  const auto note = sentence(evidence.note);
  return fmt::format("{}{}{}{}{}{}{}{}{}", time_words(evidence, report),
                     evidence.event.empty() ? "" : "  ", printable(evidence.event),
                     id("cpu", evidence.cpu), id("pid", evidence.pid), id("tid", evidence.tid),
                     note.empty() ? "" : "  ", printable(note), place_of(evidence));
}

std::string headline_of(const analysis::SubjectVerdict& subject) {
  for (const auto& evidence : subject.evidence) {
    if (!evidence.note.empty()) return printable(sentence(evidence.note));
  }
  return std::string(analysis::label(subject.verdict));
}

std::vector<const analysis::Note*> main_notes(std::string_view rule,
                                              const analysis::SubjectVerdict& subject) {
  constexpr std::size_t kMost = 4;  // of M5: what it was and is, twice
  std::vector<const analysis::Note*> notes;
  for (auto i = main_evidence_of(rule); i < std::min(subject.evidence.size(), kMost); ++i) {
    if (const auto& note = subject.evidence[i].note; !note.empty()) notes.push_back(&note);
  }
  return notes;
}

std::string_view violation_of(std::string_view rule) {
  const auto* page = analysis::find_rule_page(rule);
  return page == nullptr ? "broke a rule" : page->violation;
}

std::string message_of(const analysis::RuleVerdict& rule, const analysis::SubjectVerdict& subject) {
  if (subject.verdict != analysis::Verdict::fail) return headline_of(subject);
  std::string text(violation_of(rule.id));
  const auto* between = text.empty() ? "" : ": ";
  for (const auto* note : main_notes(rule.id, subject)) {
    text += between + printable(sentence(*note));
    between = "; ";
  }
  return text.empty() ? headline_of(subject) : text;
}

std::string term_of(const analysis::Suppression& suppression) {
  const auto& expires = suppression.expires;
  return suppression.is_expired ? "suppression expired after " + expires
         : expires == "never"   ? "suppressed for ever"
                                : "suppressed until " + expires;
}

std::string words_of(const analysis::Suppression& suppression) {
  return fmt::format("{} ({}): {}", term_of(suppression), printable(suppression.place),
                     printable(suppression.reason));
}

std::vector<std::string> useless_suppressions(const analysis::VerdictReport& verdicts) {
  std::vector<std::string> sentences;
  if (!verdicts.suppressions) return sentences;
  for (const auto& use : verdicts.suppressions->uses) {
    const auto& suppression = use.suppression;
    const auto name = fmt::format("suppression {} ({} {})", printable(suppression.place),
                                  suppression.rule, printable(suppression.subject));
    if (suppression.is_expired) {
      sentences.push_back(
          fmt::format("{} expired after {}{}", name, suppression.expires, after_expiry(use)));
    } else if (use.matched == 0) {
      sentences.push_back(
          fmt::format("{} is unused: nothing it names is violated or undecided", name));
    }
  }
  return sentences;
}

bool is_of_isolated_executor(const analysis::SubjectVerdict& subject,
                             const analysis::ReportRows& rows) {
  using analysis::SubjectKind;
  const auto& about = subject.about;
  const auto* process = about.process ? rows.find(*about.process) : nullptr;
  if (process == nullptr || !about.index || !has_isolated_executor(*process)) return false;
  if (is_isolated_executor_alone(*process)) return true;
  const auto is_isolated = [&rows](analysis::ThreadIndex index) {
    const auto* thread = rows.find(index);
    return thread != nullptr && thread->role == ThreadRole::callback;
  };
  if (about.kind == SubjectKind::thread) return is_isolated(analysis::ThreadIndex{*about.index});
  if (about.kind == SubjectKind::group) return true;  // of isolated threads alone (rule M8)
  if (about.kind != SubjectKind::callback) return false;
  const auto* callback = rows.find(analysis::CallbackIndex{*about.index});
  return callback != nullptr &&
         std::ranges::any_of(callback->threads, is_isolated, &analysis::CallbackThread::thread);
}

ExecutorSeen executor_of(const analysis::RuleVerdict& rule, const analysis::Report& report) {
  const analysis::ReportRows rows(report);
  for (const auto& subject : rule.subjects) {
    if (subject.verdict != analysis::Verdict::fail || !subject.about.process) continue;
    if (is_of_isolated_executor(subject, rows)) return ExecutorSeen::isolated;
    const auto* process = rows.find(*subject.about.process);
    if (process != nullptr && process->executor) return ExecutorSeen::other;
  }
  return ExecutorSeen::none;
}

std::string_view remedy_of_rule(std::string_view rule, bool is_of_rclcpp) {
  const auto* page = analysis::find_rule_page(rule);
  if (page == nullptr) return {};
  return is_of_rclcpp && !page->remedy_rclcpp.empty() ? page->remedy_rclcpp : page->remedy;
}

namespace {

// That a request failed with; 0: none did.
std::int64_t errno_of(const analysis::SubjectVerdict& subject) {
  for (const auto& evidence : subject.evidence) {
    const auto* failed = analysis::find_note(evidence.note, "request-failed");
    const auto* error = failed != nullptr ? find_argument(*failed, "errno") : nullptr;
    if (error != nullptr) return std::get<std::int64_t>(error->value);
  }
  return 0;
}

}  // namespace

std::string_view remedy_of_refusal(const analysis::RuleVerdict& rule) {
  std::int64_t only = 0;
  for (const auto& subject : rule.subjects) {
    if (subject.verdict != analysis::Verdict::fail) continue;
    const auto error = errno_of(subject);
    if (error == 0 || (only != 0 && only != error)) return {};
    only = error;
  }
  switch (only) {
    case EPERM:
      return "give the application CAP_SYS_NICE or a higher limit (ulimit -r, ulimit -e), and look at its own "
             "message";
    case EBUSY:
      return "reserve less in all (runtime / period): the kernel's admission test of SCHED_DEADLINE refused it";
    case EINVAL:
      return "look at the values that were asked for, and whether its cpuset allows one of the CPUs";
    default:
      return {};
  }
}

std::string defects_of_trace(std::string_view names) {
  return fmt::format("defects of the trace (what they hide stays undecided): {}", names);
}

std::unordered_set<std::uint32_t> callbacks_violating(const analysis::VerdictReport& verdicts,
                                                      std::string_view id) {
  std::unordered_set<std::uint32_t> callbacks;
  const auto rule = std::ranges::find(verdicts.rules, id, &analysis::RuleVerdict::id);
  if (rule == verdicts.rules.end()) return callbacks;
  for (const auto& subject : rule->subjects) {
    const auto& about = subject.about;
    const bool is_callback = about.kind == analysis::SubjectKind::callback && about.index;
    if (is_callback && subject.verdict == analysis::Verdict::fail) callbacks.insert(*about.index);
  }
  return callbacks;
}

int gravity_of(std::string_view rule) {
  const auto* page = analysis::find_rule_page(rule);
  return page == nullptr ? 0 : page->gravity;
}

bool needs_spec(std::string_view rule) {
  const auto* page = analysis::find_rule_page(rule);
  return page != nullptr && page->needs_spec;
}

std::size_t main_evidence_of(std::string_view rule) {
  const auto* page = analysis::find_rule_page(rule);
  return page == nullptr ? 0 : page->main_evidence;
}

}  // namespace cie::viewer_export
