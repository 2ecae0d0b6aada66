#include <cie/analysis/rule_pages.hpp>

#include "completeness_rules.hpp"
#include "execution_rules.hpp"
#include "judgement.hpp"
#include "mapping_rules.hpp"
#include "message_rules.hpp"
#include "model/recorded_parts.hpp"
#include "model/sort_rows.hpp"
#include "ownership_rules.hpp"
#include "parameter_rules.hpp"
#include "restart_rule.hpp"
#include "rule.hpp"
#include "stability_rules.hpp"
#include "timing_rules.hpp"
#include "trace_rules.hpp"

#include <algorithm>
#include <compare>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Orders texts as readers expect, numbers in them by value: "thread 9" before "thread 10".
std::weak_ordering natural_order(std::string_view a, std::string_view b) {
  // What they begin with alike, up to a number that goes on.
  auto alike = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  while (alike > 0 && is_digit(a[alike - 1]))
    --alike;
  a.remove_prefix(alike);
  b.remove_prefix(alike);
  while (!a.empty() && !b.empty()) {
    if (!is_digit(a.front()) || !is_digit(b.front())) {
      if (a.front() != b.front()) return a.front() <=> b.front();
      a.remove_prefix(1);
      b.remove_prefix(1);
      continue;
    }
    const auto take = [](std::string_view& text) {
      const auto end = std::min(text.find_first_not_of("0123456789"), text.size());
      auto digits = text.substr(0, end);
      text.remove_prefix(end);
      digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
      return digits;
    };
    const auto x = take(a);
    const auto y = take(b);
    if (x.size() != y.size()) return x.size() <=> y.size();
    if (x != y) return x <=> y;
  }
  return a.size() <=> b.size();
}

bool comes_before(const SubjectVerdict& a, const SubjectVerdict& b) {
  if (const auto order = natural_order(a.subject, b.subject); order != 0) return order < 0;
  const auto key = [](const SubjectVerdict& verdict) {
    const auto* first = verdict.evidence.empty() ? nullptr : verdict.evidence.data();
    return std::tuple(std::string_view(verdict.subject), verdict.verdict, verdict.checked,
                      first == nullptr ? Timestamp{} : first->time,
                      first == nullptr ? std::string_view() : std::string_view(first->note),
                      verdict.about.index);
  };
  return key(a) < key(b);
}

// Rules that judge instances have no subject at all when no start was recorded.
std::optional<SubjectVerdict> absent_starts(const Rule& rule, const Model& model) {
  if (!rule.needs.instances || model.events.by_name.contains("callback_start")) {
    return std::nullopt;
  }
  const auto& callbacks = model.callbacks;
  const auto has_run = std::ranges::find_if(callbacks, [](const CallbackFacts& callback) {
    return callback.ended.count != 0 || callback.starts_outside != 0 ||
           (callback.fini && callback.fini->started != 0);
  });
  if (has_run == callbacks.end()) return std::nullopt;
  Judgement judgement(NamedSubject::trace());
  const bool has_outside = std::ranges::any_of(
      callbacks, [](const CallbackFacts& callback) { return callback.starts_outside != 0; });
  judgement.doubt(without_event(moment(model.begin.value_or(Timestamp{})),
                                has_outside ? "no callback started in the window"
                                            : "callbacks ran, but no callback_start was recorded"));
  return std::move(judgement).finish();
}

// What no process can be told of may have been anybody's instances.
void doubt_events_without_pid(const Rule& rule, const RuleContext& context,
                              std::vector<SubjectVerdict>& subjects) {
  const auto without = context.model.events.cie_without_pid;
  const bool is_judged = context.options.spec != nullptr || !rule.needs.spec;
  if (without == 0 || !rule.needs.instances || !is_judged) return;
  Judgement judgement(NamedSubject::trace());
  judgement.doubt(
      without_event(moment(context.model.begin.value_or(Timestamp{})),
                    counted(without, "event") + " without the context vpid belong to no process"));
  conclude(std::move(judgement), subjects);
}

// Names the file and the packet of each event.
void locate(const Model& model, std::vector<Evidence>& evidence) {
  for (auto& item : evidence) {
    if (!item.stream || *item.stream >= model.streams.size()) continue;
    const auto& stream = model.streams[*item.stream];
    item.file = stream.path;
    const auto& begins = stream.packet_begins;
    const auto next = std::ranges::upper_bound(begins, item.time);
    if (next == begins.begin() || stream.packets != begins.size()) continue;
    auto packet = static_cast<std::uint64_t>(next - begins.begin() - 1);
    const auto& later = stream.later_files;
    const auto file = std::ranges::upper_bound(later, packet, {}, &StreamFacts::File::first_packet);
    if (file != later.begin()) {
      item.file = std::prev(file)->path;
      packet -= std::prev(file)->first_packet;
    }
    item.packet = packet;
  }
}

// Where two processes are seen to have one pid: the last of them, or none. By pid, those that had it
// before or after among them, and of any.
struct SharedPids {
  std::map<std::pair<HostIndex, std::int64_t>, Evidence> by_pid;
  std::optional<Evidence> any;
};

Evidence sharing(const ProcessFacts& process) {
  const auto since = [&process](const char* why) {
    return without_event(*process.shares_pid_since, why);
  };
  switch (process.pid_sharing) {
    case PidSharing::other_init:
      return since(
          "another process of this pid has another callback of this id, and its "
          "run_begin was not recorded");
    case PidSharing::perhaps:
      return since(
          "events were lost since the run_end of this pid: what follows may be of another "
          "process, and its run_begin was not recorded");
    case PidSharing::announced_late:
      return since(
          "this process began before the last instances that are told of the former one of its pid: "
          "they are its own, and of the former one's which are is unknown");
    case PidSharing::told_again:
      return since(
          "what a process tells once came twice: another one has this pid, and its run_begin was "
          "not recorded");
    case PidSharing::crossed:
      return since(
          "instances on one thread overlap and do not nest: two processes have this pid, as "
          "those of containers, which need a recording each");
    case PidSharing::beside_own:
      return since(
          "ROS 2's events tell of an instance since another rcl_init of this pid, of which this "
          "project's tell nothing: another process has it, or another executor runs there");
    case PidSharing::begun:
      break;
  }
  return since(
      "two processes have this pid: containers, which need a recording each, or a child "
      "of fork() without exec(), which needs LD_PRELOAD=liblttng-ust-fork.so.1");
}

SharedPids shared_pids(const Model& model) {
  SharedPids shared;
  for (const auto& process : model.processes) {
    if (!process.shares_pid_since) continue;
    shared.any = sharing(process);
    shared.by_pid.insert_or_assign({process.host, process.pid}, *shared.any);
  }
  return shared;
}

// Of processes whose events cannot be told apart neither a pass nor a violation is proven. A
// subject of no process, or of several, may be any process's.
void doubt_shared_pids(const Rule& rule, const Model& model, const SharedPids& shared,
                       std::vector<SubjectVerdict>& subjects) {
  if (!shared.any) return;
  for (auto& subject : subjects) {
    const bool is_about_trace =
        subject.about.kind == SubjectKind::trace && rule.needs.is_about_trace;
    if (is_about_trace || subject.verdict == Verdict::not_applicable) continue;
    auto since = shared.any;
    if (subject.about.process) {
      const auto& process = model.processes[at(*subject.about.process)];
      const auto found = shared.by_pid.find({process.host, process.pid});
      if (found == shared.by_pid.end()) continue;
      since = found->second;
    }
    subject.verdict = Verdict::inconclusive;
    subject.evidence = {*since};
  }
}

// ROS 2's events have neither numbers nor totals: there any part of a recording may lack some.
bool has_totals(const Model& model, const Subject& subject) {
  if (subject.process) return !is_told_by_ros2_alone(model.processes[at(*subject.process)]);
  return std::ranges::none_of(model.processes, is_told_by_ros2_alone);
}

// L7: of what is missing nobody knows what a rule would have said, so what is left does not pass in
// its place. A subject is judged as ever: its numbers and totals tell what it lost.
void doubt_missing_part(const Rule& rule, const RuleContext& context, const std::string& missing,
                        std::vector<SubjectVerdict>& subjects) {
  if (context.options.spec == nullptr && rule.needs.spec) return;
  const auto doubt = evidence("missing_part", moment(context.model.begin.value_or(Timestamp{})),
                              "not all that was recorded is here: " + missing);
  if (rule.needs.whole_recording || rule.needs.totals) {
    for (auto& subject : subjects) {
      if (subject.verdict != Verdict::fail) continue;
      if (!rule.needs.whole_recording && has_totals(context.model, subject.about)) continue;
      subject.verdict = Verdict::inconclusive;
      subject.evidence.insert(subject.evidence.begin(), doubt);
    }
  }
  const bool is_doubted = std::ranges::any_of(subjects, [](const SubjectVerdict& subject) {
    return subject.about.kind == SubjectKind::trace && subject.verdict >= Verdict::inconclusive;
  });
  if (is_doubted) return;
  Judgement judgement(NamedSubject::trace());
  judgement.doubt(doubt);
  conclude(std::move(judgement), subjects);
}

void leave_out_passes(std::vector<SubjectVerdict>& subjects) {
  std::erase_if(subjects, [](const SubjectVerdict& subject) {
    return subject.verdict < Verdict::inconclusive;
  });
  subjects.shrink_to_fit();
}

// Of what manifests say was recorded.
struct MissingParts {
  std::optional<std::string> of_user;
  std::optional<std::string> of_kernel;

  const std::optional<std::string>& for_rule(const Rule& rule) const {
    return of_user || !rule.needs.kernel ? of_user : of_kernel;
  }
};

RuleVerdict judge(const Rule& rule, const RuleContext& context, const SharedPids& shared,
                  const MissingParts& parts) {
  RuleVerdict verdict{
      .id = std::string(rule.id), .name = std::string(rule.name), .subjects = rule.judge(context)};
  if (verdict.subjects.empty()) {
    if (auto absent = absent_starts(rule, context.model)) verdict.subjects.push_back(*absent);
  }
  doubt_events_without_pid(rule, context, verdict.subjects);
  doubt_shared_pids(rule, context.model, shared, verdict.subjects);
  const auto& missing = parts.for_rule(rule);
  if (missing) doubt_missing_part(rule, context, *missing, verdict.subjects);
  if (context.options.is_judged) sort_rows(verdict.subjects, comes_before);
  for (auto& subject : verdict.subjects) {
    verdict.verdict = std::max(verdict.verdict, subject.verdict);
    locate(context.model, subject.evidence);
  }
  if (!context.options.is_judged) leave_out_passes(verdict.subjects);
  return verdict;
}

RulePage page_of(const Rule& rule) {
  RulePage page{.id = rule.id,
                .name = rule.name,
                .page = std::string(rule.meaning),
                .meaning = rule.meaning,
                .why_it_matters = rule.why_it_matters,
                .inconclusive_when = rule.inconclusive_when,
                .remedy = rule.remedy,
                .remedy_rclcpp = rule.remedy_rclcpp,
                .violation = rule.violation,
                .gravity = rule.gravity,
                .main_evidence = rule.main_evidence};
  const auto add = [&page](std::string_view begin, std::string_view paragraph) {
    if (!paragraph.empty()) page.page.append("\n").append(begin).append(paragraph);
  };
  add(kWhyItMatters, rule.why_it_matters);
  add(kInconclusiveWhen, rule.inconclusive_when);
  add(kRemedy, rule.remedy);
  add(kRemedyWithRclcpp, rule.remedy_rclcpp);
  return page;
}

}  // namespace

const std::vector<Rule>& rules() {
  static const std::vector<Rule> all{kTraceReadable,
                                     kNoLoss,
                                     kSeqContiguous,
                                     kRunComplete,
                                     kRequiredEvents,
                                     kTimeSane,
                                     kSpecifiedCallbackSeen,
                                     kOneCallbackPerThread,
                                     kOneThreadPerCallback,
                                     kMappingPersistent,
                                     kMappingSurvivesRestart,
                                     kNoForeignWork,
                                     kUniqueLogicalId,
                                     kSingleCallbackGroup,
                                     kThreadKnown,
                                     kParametersAsSpecified,
                                     kParametersBeforeFirstCallback,
                                     kParametersUnchanged,
                                     kAllowedCpusOnly,
                                     kNoParameterLeak,
                                     kStartEndPaired,
                                     kNonReentrant,
                                     kNoNesting,
                                     kArrivalExceedsTurnaround,
                                     kNoMissedRelease,
                                     kDeadline,
                                     kBudget,
                                     kRate,
                                     kNoQueueOverflow,
                                     kChainBounds};
  return all;
}

const std::vector<RulePage>& rule_pages() {
  static const std::vector<RulePage> all = [] {
    std::vector<RulePage> pages;
    for (const auto& rule : rules())
      pages.push_back(page_of(rule));
    return pages;
  }();
  return all;
}

const RulePage* find_rule_page(std::string_view id) {
  const auto& pages = rule_pages();
  const auto found = std::ranges::find(pages, id, &RulePage::id);
  return found == pages.end() ? nullptr : &*found;
}

VerdictReport verify(const RuleContext& context) {
  VerdictReport report;
  const MissingParts missing{.of_user = context.proof.missing_user_part(),
                             .of_kernel = missing_kernel_part(context.model)};
  const auto shared = shared_pids(context.model);
  for (const auto& rule : rules()) {
    if (!context.options.is_judged && !rule.needs.is_of_report) continue;
    report.rules.push_back(judge(rule, context, shared, missing));
  }
  report.verdict = overall_verdict(report);
  return report;
}

Verdict counted_verdict(const RuleVerdict& rule) noexcept {
  if (rule.subjects.empty()) return rule.verdict;
  auto verdict = Verdict::not_applicable;
  for (const auto& subject : rule.subjects) {
    if (!subject.is_suppressed()) verdict = std::max(verdict, subject.verdict);
  }
  return verdict;
}

Verdict overall_verdict(const VerdictReport& verdicts) noexcept {
  auto verdict = Verdict::pass;
  for (const auto& rule : verdicts.rules)
    verdict = std::max(verdict, counted_verdict(rule));
  return verdict;
}

std::string_view label(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::not_applicable:
      return "NOT_APPLICABLE";
    case Verdict::pass:
      return "PASS";
    case Verdict::inconclusive:
      return "INCONCLUSIVE";
    case Verdict::fail:
      return "FAIL";
  }
  return "";
}

}  // namespace cie::analysis
