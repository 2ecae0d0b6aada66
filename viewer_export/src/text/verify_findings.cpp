#include "verify_findings.hpp"

#include <cie/analysis/comparison.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "tables/report_tables.hpp"
#include "verify_subjects.hpp"
#include "words/note_words.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"
#include "worst_run_words.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::Isolation;
using analysis::RuleVerdict;
using analysis::SubjectKind;
using analysis::SubjectVerdict;
using analysis::ThreadReport;
using analysis::Verdict;

// That missed deadlines.
const CallbackReport* late_callback(const Judged& judged, const SubjectVerdict& subject) {
  const auto* callback = reported_callback(judged, subject);
  return callback == nullptr || callback->late.value_or(0) == 0 ? nullptr : callback;
}

// "plan timer 1 ns", "pool-0 (4008)": the kind stands in the rule's line, and on one host a tid needs
// no pid.
std::string name_of(const Judged& judged, const SubjectVerdict& subject) {
  if (const auto* callback = reported_callback(judged, subject)) return judged.names.of(*callback);
  const auto* thread = reported_thread(judged, subject);
  const bool is_unique = thread != nullptr && judged.report.trace.hosts.size() < 2;
  auto name = std::string(subject.name()) + subject.ordinal;
  if (!is_unique) name += subject.place;
  const auto kind = label(subject.about.kind);
  const bool is_small_number = subject.about.kind == SubjectKind::group;  // "group 0"
  if (!is_small_number && name.starts_with(kind) && name.size() > kind.size())
    name.erase(0, kind.size() + 1);
  if (thread == nullptr || thread->name.empty()) return printable(name);
  return fmt::format("{} ({})", printable(thread->name), printable(name));
}

// What a thread ran, by id: one that took the place of another one has the id of that.
struct RunsOfIds {
  std::string count;  // "2 callbacks", "1 callback in 2 lifetimes"
  std::string names;  // ": plan timer 1 ns, drive <- /pose", the most frequent first
};

RunsOfIds runs_of_callbacks(const Judged& judged, const ThreadReport& thread) {
  std::vector<std::pair<std::uint64_t, std::string_view>> ran;
  std::map<std::string_view, std::size_t> places;  // in it: a thread may have run thousands
  for (const auto index : thread.ran) {
    const auto* callback = judged.rows.find(index);
    if (callback == nullptr) continue;
    const auto here =
        std::ranges::find(callback->threads, thread.index, &analysis::CallbackThread::thread);
    const auto runs = here == callback->threads.end() ? 0 : here->instances;
    const auto [place, is_new] = places.try_emplace(callback->logical_id, ran.size());
    if (is_new) ran.emplace_back(0, callback->logical_id);
    ran[place->second].first += runs;
  }
  std::ranges::stable_sort(ran, std::ranges::greater{},
                           [](const auto& pair) { return pair.first; });
  RunsOfIds words{.count = counted(thread.ran.size(), "callback"), .names = {}};
  if (!ran.empty() && ran.size() < thread.ran.size()) {
    words.count = fmt::format("{} in {}", counted(ran.size(), "callback"),
                              counted(thread.ran.size(), "lifetime"));
  }
  for (const auto& [runs, id] : ran)
    words.names += (words.names.empty() ? ": " : ", ") + judged.names.of_id(id);
  return words;
}

// "2 threads: 21 on pool-1, 19 on 4008": how many complete instances on each, if any, which is told by
// its name where that tells it from the callback's others.
std::string runs_on_threads(const CallbackReport& callback) {
  auto threads = callback.threads;
  std::ranges::stable_sort(threads, std::ranges::greater{}, &analysis::CallbackThread::instances);
  std::string text = counted(threads.size(), "thread");
  for (std::size_t i = 0; i < threads.size(); ++i) {
    const auto& thread = threads[i];
    const bool is_told =
        !thread.name.empty() &&
        std::ranges::count(threads, thread.name, &analysis::CallbackThread::name) == 1;
    const auto name = is_told ? printable(thread.name) : fmt::format("{}", thread.tid);
    text += i == 0 ? ": " : ", ";
    text += thread.instances == 0 ? name : fmt::format("{} on {}", thread.instances, name);
  }
  return text;
}

// What the evidence says.
std::string told_by_evidence(const Judged& judged, const RuleVerdict& rule,
                             const SubjectVerdict& subject) {
  const auto text = sentence(main_notes(rule.id, subject), judged.names);
  return text.empty() ? headline_of(subject) : text;
}

// Of the spec; null without.
const SpecEntry* entry_of(const Judged& judged, const CallbackReport& callback) {
  const auto* spec = judged.context.spec;
  return spec == nullptr ? nullptr
                         : spec->find_callback(callback.logical_id, callback.period_ns.value_or(0));
}

// " (app.yaml:7)"; empty: the callback declares its deadline itself.
std::string place_of_deadline(const Judged& judged, const CallbackReport& callback) {
  const auto* entry = entry_of(judged, callback);
  if (entry == nullptr || !entry->response_deadline_ns) return {};
  return fmt::format(" ({}:{})", printable(file_name(judged.context.spec->name())), entry->line);
}

std::string late_runs(const Judged& judged, const CallbackReport& callback) {
  auto text = fmt::format("late {} of {}", *callback.late, callback.instances);
  if (const auto* worst = worst_run_of(judged, callback)) {
    text += ", up to " + format_excess(worst->response_time.ns, callback.response_deadline->ns);
  }
  return text + place_of_deadline(judged, callback);
}

// Of R1, where one instance was seen to end after the next one was released. Elsewhere the longest
// response time and the shortest inter-arrival time are of different instances.
std::string overtaken(const SubjectVerdict& subject) {
  const bool is_seen = !subject.evidence.empty() && subject.evidence[0].event == "callback_end";
  return is_seen ? "; one overran" : "";
}

struct Told {
  double weight = 0;   // larger is worse
  std::string detail;  // subjects with the same one are told together
  std::string of_one;  // what follows where it is the only one
};

// How many times what the spec allows a callback's longest execution time is; 0: not known.
double times_budget(const Judged& judged, const CallbackReport& callback) {
  const auto* entry = entry_of(judged, callback);
  if (entry == nullptr || entry->wcet_ns.value_or(0) <= 0 || !callback.execution_time) return 0;
  return static_cast<double>(callback.execution_time->max) / static_cast<double>(*entry->wcet_ns);
}

Told told_of(const Judged& judged, const RuleVerdict& rule, const SubjectVerdict& subject) {
  const auto* thread = reported_thread(judged, subject);
  const auto* callback = reported_callback(judged, subject);
  const auto* late = late_callback(judged, subject);
  if (rule.id == analysis::kOneCallbackPerThreadRule && thread != nullptr &&
      thread->ran.size() > 1) {
    auto [count, names] = runs_of_callbacks(judged, *thread);
    return {.weight = static_cast<double>(thread->ran.size()),
            .detail = std::move(count),
            .of_one = std::move(names)};
  }
  if (rule.id == analysis::kOneThreadPerCallbackRule && callback != nullptr &&
      callback->threads.size() > 1) {
    return {.weight = static_cast<double>(callback->threads.size()),
            .detail = runs_on_threads(*callback),
            .of_one = {}};
  }
  if (rule.id == analysis::kDeadlineRule && late != nullptr) {
    return {.weight = analysis::times_deadline(*late),
            .detail = late_runs(judged, *late),
            .of_one = {}};
  }
  if (rule.id == analysis::kArrivalExceedsTurnaroundRule && callback != nullptr &&
      callback->response_time && callback->inter_arrival) {
    const auto longest = callback->response_time->max;
    const auto shortest = callback->inter_arrival->min;
    return {.weight = static_cast<double>(longest),
            .detail = fmt::format("up to {}, releases as close as {}{}", format_duration(longest),
                                  format_duration(shortest), difference_unseen(shortest, longest)),
            .of_one = overtaken(subject)};
  }
  if (rule.id == analysis::kNoMissedReleaseRule && callback != nullptr &&
      callback->missed_releases.value_or(0) > 0) {
    const auto missed = *callback->missed_releases;
    return {.weight = static_cast<double>(missed),
            .detail = fmt::format("{} skipped, {}", counted(missed, "period"),
                                  counted(callback->instances, "instance")),
            .of_one = {}};
  }
  double weight = 0;
  if (rule.id == analysis::kBudgetRule && callback != nullptr)
    weight = times_budget(judged, *callback);
  if (rule.id == analysis::kNoQueueOverflowRule && callback != nullptr) {
    weight = static_cast<double>(callback->lost_samples.value_or(0) +
                                 callback->overwritten_samples.value_or(0));
  }
  return {.weight = weight, .detail = told_by_evidence(judged, rule, subject), .of_one = {}};
}

std::string counted_subjects(std::size_t count, std::optional<std::size_t> of,
                             std::optional<SubjectKind> kind) {
  if (kind == SubjectKind::trace) return "the recording";
  const auto noun = kind ? label(*kind) : std::string_view("subject");
  const auto total = counted(of.value_or(count), noun);
  return of ? fmt::format("{} of {}", count, total) : total;
}

Finding finding_of(const Judged& judged, const RuleVerdict& rule) {
  struct Ranked {
    const SubjectVerdict* subject;
    Told told;
  };
  std::vector<Ranked> ranked;
  for (const auto& subject : rule.subjects) {
    if (counts(subject, Verdict::fail))
      ranked.push_back({&subject, told_of(judged, rule, subject)});
  }
  std::ranges::stable_sort(ranked, std::ranges::greater{},
                           [](const Ranked& item) { return item.told.weight; });
  Finding finding{.rule = &rule,
                  .violating = ranked.size(),
                  .subjects = {},
                  .violation = violation_of(rule.id),
                  .rows = {},
                  .order = {},
                  .worst = {}};
  // A rule may doubt the trace besides, which is none of the callbacks that it judged.
  std::set<SubjectKind> kinds;
  for (const auto& item : ranked)
    kinds.insert(item.subject->about.kind);
  const auto kind = kinds.size() == 1 ? std::optional(*kinds.begin()) : std::nullopt;
  const auto applicable = std::ranges::count_if(rule.subjects, [kind](const auto& subject) {
    return subject.verdict != Verdict::not_applicable && (!kind || subject.about.kind == *kind);
  });
  finding.subjects = counted_subjects(ranked.size(), static_cast<std::size_t>(applicable), kind);
  std::map<std::string_view, std::size_t> places;  // of rows, by what they say
  for (const auto& [subject, told] : ranked) {
    const auto [place, is_new] = places.try_emplace(told.detail, finding.rows.size());
    if (is_new) finding.rows.push_back({.names = {}, .detail = told.detail, .more = {}});
    finding.rows[place->second].names.push_back(name_of(judged, *subject));
  }
  for (const auto& [subject, told] : ranked) {
    auto& row = finding.rows[places.at(told.detail)];
    if (row.names.size() == 1) row.more = told.of_one;
  }
  const auto* late = ranked.empty() ? nullptr : late_callback(judged, *ranked.front().subject);
  const auto* worst = late == nullptr ? nullptr : worst_run_of(judged, *late);
  if (rule.id != analysis::kDeadlineRule) return finding;
  if (finding.rows.size() > 1) finding.order = "worst first";
  if (worst != nullptr) finding.worst = where_time_went(judged, *worst);
  return finding;
}

std::string share_of_callbacks(std::ptrdiff_t some, std::ptrdiff_t all) {
  return fmt::format("{} of {}", some, counted(static_cast<std::uint64_t>(all), "callback"));
}

// Threads that did not get their parameters explain why nothing ran: an executor refuses to run so.
void put_cause_first(const Judged& judged, std::vector<Finding>& findings) {
  const auto cause = std::ranges::find_if(
      findings, [](const Finding& finding) { return finding.rule->id == "S1"; });
  const bool is_consequence =
      cause != findings.end() &&
      findings.front().rule->id == analysis::kSpecifiedCallbackSeenRule &&
      are_all_registered(*findings.front().rule) &&
      std::ranges::all_of(judged.report.callbacks, &CallbackReport::never_ran);
  if (is_consequence) std::rotate(findings.begin(), cause, std::next(cause));
}

}  // namespace

std::string_view file_name(std::string_view path) {
  return path.substr(path.rfind('/') + 1);  // npos + 1 is 0
}

std::string told_of_violation(const Judged& judged, const RuleVerdict& rule,
                              const SubjectVerdict& subject) {
  constexpr std::size_t kMost = 240;  // a thread may have run thousands of callbacks
  const auto told = told_of(judged, rule, subject);
  return cut(told.detail + told.of_one, kMost, "...");
}

std::vector<const SubjectVerdict*> violating_worst_first(const Judged& judged,
                                                         const RuleVerdict& rule) {
  std::vector<std::pair<double, const SubjectVerdict*>> weighed;
  for (const auto& subject : rule.subjects) {
    if (subject.verdict != Verdict::fail) continue;
    constexpr double kLast = -1;
    const auto weight = subject.is_suppressed() ? kLast : told_of(judged, rule, subject).weight;
    weighed.emplace_back(weight, &subject);
  }
  std::ranges::stable_sort(weighed, std::ranges::greater{},
                           [](const auto& item) { return item.first; });
  std::vector<const SubjectVerdict*> subjects(weighed.size());
  std::ranges::transform(weighed, subjects.begin(), [](const auto& item) { return item.second; });
  return subjects;
}

std::vector<Finding> findings_of(const Judged& judged) {
  std::vector<Finding> findings;
  for (const auto& rule : judged.verdicts.rules) {
    if (analysis::counted_verdict(rule) == Verdict::fail)
      findings.push_back(finding_of(judged, rule));
  }
  std::ranges::stable_sort(findings, std::ranges::greater{},
                           [](const Finding& finding) { return gravity_of(finding.rule->id); });
  put_cause_first(judged, findings);
  return findings;
}

std::vector<Doubt> doubts_of(const Judged& judged) {
  struct Gathered {
    std::set<std::string> notes;
    std::vector<std::string> rules;
    std::set<std::string> subjects;
    std::set<SubjectKind> kinds;
  };
  std::map<std::string, std::size_t> place_of;  // by what shows why, whatever it is about
  std::vector<Gathered> reasons;
  for (const auto& rule : judged.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      if (!counts(subject, Verdict::inconclusive)) continue;
      const auto* first = subject.evidence.empty() ? nullptr : &subject.evidence[0];
      const auto says = first == nullptr      ? std::string("no evidence")
                        : first->note.empty() ? printable(first->event)
                                              : sentence(first->note, judged.names);
      const auto [place, is_new] = place_of.try_emplace(
          first == nullptr || first->note.empty() ? says : codes_of(first->note), reasons.size());
      if (is_new) reasons.emplace_back();
      auto& gathered = reasons[place->second];
      gathered.notes.insert(says);
      if (gathered.rules.empty() || gathered.rules.back() != rule.id)
        gathered.rules.push_back(rule.id);
      gathered.subjects.insert(subject.name_told_apart());
      gathered.kinds.insert(subject.about.kind);
    }
  }
  std::vector<Doubt> doubts;
  for (const auto& gathered : reasons) {
    const auto kind =
        gathered.kinds.size() == 1 ? std::optional(*gathered.kinds.begin()) : std::nullopt;
    const auto& example = *gathered.notes.begin();
    doubts.push_back({.reason = gathered.notes.size() == 1 ? example : "e.g. " + example,
                      .rules = gathered.rules,
                      .subjects = counted_subjects(gathered.subjects.size(), std::nullopt, kind),
                      .count = gathered.subjects.size()});
  }
  std::ranges::stable_sort(doubts, std::ranges::greater{}, &Doubt::count);
  return doubts;
}

std::string isolation_fact(const analysis::Report& report) {
  const auto ran = static_cast<std::ptrdiff_t>(report.callbacks.size()) -
                   callbacks_with(report, Isolation::never_ran);
  if (ran == 0) {
    if (report.callbacks.empty()) return "no callback was seen";
    if (std::ranges::any_of(report.callbacks, &analysis::CallbackReport::has_run))
      return "no whole instance of a callback was seen";
    const auto is_idle = [](const analysis::CallbackReport& callback) {
      return callback.never_ran() && !callback.may_lack_runs;
    };
    return std::ranges::all_of(report.callbacks, is_idle) ? "no callback ran"
                                                          : "no instance of a callback was seen";
  }
  if (const auto shared = callbacks_with(report, Isolation::not_isolated); shared > 0) {
    return share_of_callbacks(shared, ran) +
           (is_any_thread_shared(report) ? " share threads" : " ran on several threads");
  }
  const auto all = static_cast<std::ptrdiff_t>(report.callbacks.size());
  const auto isolated = callbacks_with(report, Isolation::isolated);
  if (isolated == 0) return "whether callbacks share threads is not known";
  return fmt::format("{}{} had a thread of {} own{}", share_of_callbacks(isolated, ran),
                     ran < all ? " that ran" : "", ran == 1 ? "its" : "their",
                     isolated < ran ? "; of the others it is not known" : "");
}

std::string isolation_seen(const Judged& judged) {
  const auto& report = judged.report;
  const auto fact = isolation_fact(report);
  const bool is_undecided = std::ranges::any_of(judged.verdicts.rules, [](const auto& rule) {
    return (rule.id == analysis::kOneCallbackPerThreadRule ||
            rule.id == analysis::kOneThreadPerCallbackRule) &&
           rule.verdict == Verdict::inconclusive;
  });
  const bool is_proof_needed = callbacks_with(report, Isolation::not_isolated) == 0 &&
                               callbacks_with(report, Isolation::isolated) > 0;
  return is_undecided && is_proof_needed ? "as far as recorded, " + fact : fact;
}

std::string gravest_fact(const Judged& judged, const std::vector<Finding>& findings) {
  const auto& gravest = findings.front();
  const auto& id = gravest.rule->id;
  if (id == analysis::kOneCallbackPerThreadRule &&
      callbacks_with(judged.report, Isolation::not_isolated) > 0)
    return isolation_fact(judged.report);
  auto text = fmt::format("{} {}", gravest.subjects, gravest.violation);
  if (id != analysis::kDeadlineRule) return text;
  std::uint64_t late = 0;
  for (const auto& subject : gravest.rule->subjects) {
    const auto* callback =
        counts(subject, Verdict::fail) ? late_callback(judged, subject) : nullptr;
    if (callback != nullptr) late += *callback->late;
  }
  std::uint64_t instances = 0;  // of all that have a deadline, as a comparison counts them
  for (const auto& callback : judged.report.callbacks) {
    if (const auto lateness = analysis::Lateness::of(callback)) instances += lateness->instances;
  }
  return late == 0 ? text
                   : fmt::format("{}: late {} of {}", text, late, counted(instances, "instance"));
}

std::string grounds_of_passes(const analysis::VerdictReport& verdicts) {
  // What PASS says, as the rules' pages have it.
  constexpr std::array<std::string_view, 3> kGrounds{"by read-back", "sampled", "announced only"};
  std::string text;
  for (const auto& rule : verdicts.rules) {
    if (analysis::counted_verdict(rule) != Verdict::pass) continue;
    for (const auto ground : kGrounds) {
      const auto rests_on_it = [ground](const analysis::SubjectVerdict& subject) {
        return subject.verdict == Verdict::pass &&
               std::ranges::find(subject.evidence, ground, &analysis::Evidence::event) !=
                   subject.evidence.end();
      };
      if (std::ranges::any_of(rule.subjects, rests_on_it))
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", rule.id, ground);
    }
  }
  return text;
}

bool is_perhaps_inherited(const analysis::SubjectVerdict& subject) {
  return subject.verdict == Verdict::pass &&
         std::ranges::any_of(subject.evidence, [](const analysis::Evidence& evidence) {
           return evidence.note.code == "perhaps-inherited-from-here" ||
                  evidence.note.code == "kernel-schedules-perhaps-inherited";
         });
}

std::string raised_priorities(const analysis::VerdictReport& verdicts) {
  for (const auto& rule : verdicts.rules) {
    const auto threads =
        static_cast<std::uint64_t>(std::ranges::count_if(rule.subjects, is_perhaps_inherited));
    if (threads == 0) continue;
    return fmt::format("{} by read-back: {} had {}, perhaps inherited", rule.id,
                       counted(threads, "thread"),
                       threads == 1 ? "a raised priority" : "raised priorities");
  }
  return {};
}

std::string unjudged_parameters(const analysis::VerdictReport& verdicts) {
  for (const auto& rule : verdicts.rules) {
    const auto callbacks = static_cast<std::uint64_t>(
        std::ranges::count_if(rule.subjects, [](const analysis::SubjectVerdict& subject) {
          return std::ranges::find(subject.evidence, "not applied", &analysis::Evidence::event) !=
                 subject.evidence.end();
        }));
    if (callbacks == 0) continue;
    return fmt::format("no rule judges the parameters of {}, which {} no own thread",
                       counted(callbacks, "callback"), callbacks == 1 ? "has" : "have");
  }
  return {};
}

}  // namespace cie::viewer_export
