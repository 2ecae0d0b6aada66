#include "completeness_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/analysis/rule_pages.hpp>
#include <cie/tracepoints/nearest_name.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/recorded_parts.hpp"
#include "parameter_words.hpp"
#include "scheduled_parameters.hpp"
#include "spec_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace cie::analysis {
namespace {

std::vector<SubjectVerdict> judge_seq_contiguous(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  const auto& proof = context.proof;
  auto verdicts = judge_callbacks(
      context, [&](CallbackIndex, const CallbackFacts& callback, Judgement& judgement) {
        judgement.checked(callback.starts.count);
        judgement.unseen(proof.gap(callback));
        if (!callback.is_accounted && callback.starts.count != 0) {
          judgement.unseen(evidence("callback_start", callback.starts.first_at,
                                    note("instances-without-numbers")));
        }
      });
  // Threads and publishers are named only if their numbers jump.
  const auto doubt = [&](NamedSubject subject, const std::optional<Evidence>& gap) {
    Judgement judgement(std::move(subject), context.known);
    judgement.unseen(gap);
    conclude(std::move(judgement), verdicts);
  };
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    if (const auto gap = proof.gap(model.threads[i]))
      doubt(names.thread(ThreadIndex{static_cast<std::uint32_t>(i)}), gap);
  }
  for (std::size_t i = 0; i < model.publishers.size(); ++i) {
    if (const auto gap = proof.gap(model.publishers[i]))
      doubt(names.topic(PublisherIndex{static_cast<std::uint32_t>(i)}), gap);
  }
  return verdicts;
}

Evidence unseen_end(const RuleContext& context, ProcessIndex index) {
  const auto& model = context.model;
  const auto& process = model.processes[at(index)];
  const auto last = process.last_seen.value_or(EventRef{});
  if (process.executed && process.executed->time >= last.time) {
    return evidence("sched_process_exec", *process.executed,
                    note(process.is_from_ros2 ? "executed-another-program"
                                              : "no-run-end-executed-another-program"));
  }
  if (process.is_from_ros2) {
    // A crash lets the kernel tell of an exit, too.
    return without_event(last, note(context.lives.has_exited(index) ? "ros2-main-thread-exited"
                                                                    : "ros2-end-untold"));
  }
  if (model.events.cie_without_pid > 0) {
    return without_event(last, note("run-end-perhaps-without-vpid"));
  }
  return without_event(last, note("no-run-end"));
}

// The recorder failed, which is no crash of the process.
Evidence unrecorded_end(const ProcessFacts& process, const RecorderFailure& failure) {
  const auto& manifest = failure.recording->manifest;
  const bool has_exited_well = manifest && manifest->exit && manifest->exit->code == 0;
  const auto problem = in_words(failure, failure.problems.front());
  return without_event(process.last_seen.value_or(EventRef{}),
                       has_exited_well
                           ? note("end-not-recorded-though-exited",
                                  {{"status", *manifest->exit->code}, {"text", problem}})
                           : note("end-not-recorded", {{"text", problem}}));
}

std::vector<SubjectVerdict> judge_run_complete(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  const auto& proof = context.proof;
  std::vector<SubjectVerdict> verdicts;
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (!process.has_cie_events) continue;
    const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
    Judgement judgement(names.process(index), context.known);
    judgement.checked(1 + proof.totals_compared(index));
    const bool is_of_ros2 = process.is_from_ros2;
    if (!has_begun_here(process)) {
      judgement.unseen(without_event(
          process.first_seen.value_or(EventRef{}),
          note("no-begin-of-process", {{"event", is_of_ros2 ? "rcl_init" : "run_begin"}})));
    }
    const auto last = process.last_seen.value_or(EventRef{});
    const auto& window = context.options.window;
    const bool outlives_window = window && last.time > window->to;
    if (!process.run_end) {
      const auto* failure = is_of_ros2 ? nullptr : proof.lost_end(index);
      auto end =
          failure != nullptr ? unrecorded_end(process, *failure) : unseen_end(context, index);
      const bool is_crash_allowed = context.options.allow_crash && failure == nullptr;
      if (is_crash_allowed || outlives_window) {
        judgement.remark(std::move(end));
      } else {
        judgement.unseen(std::move(end));
      }
    }
    for (const auto& disagreement : proof.disagreements(index))
      judgement.unseen(disagreement);
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

// What the spec names exactly.
struct Asked {
  std::string id;
  std::string place;  // "spec.yaml:3", "chain brake, spec.yaml:3"
  bool is_entry = false;
};

// Names of the trace that one which is not in it may have been meant to be. A name has one entry, so
// an entry was not meant to be what has one; a member of a chain may be.
class Suggestions {
 public:
  explicit Suggestions(std::vector<std::string> names, std::vector<std::string> without_entry)
      : names_(std::move(names)), without_entry_(std::move(without_entry)) {}

  Note of_entry(std::string_view name) { return of(name, {&without_entry_}); }
  Note of_member(std::string_view name) { return of(name, {&without_entry_, &names_}); }

 private:
  // The first of these lists that has one.
  Note of(std::string_view name, std::initializer_list<const std::vector<std::string>*> lists) {
    if (given_ == kMost) return {};
    ++given_;
    for (const auto* list : lists) {
      if (const auto meant = nearest_name(name, *list); !meant.empty())
        return note("did-you-mean", {{"name", meant}});
    }
    return {};
  }

  static constexpr int kMost = 256;  // a spec of another system has thousands that are missing
  int given_ = 0;
  std::vector<std::string> names_;
  std::vector<std::string> without_entry_;
};

// Nothing proves absence in a trace that may lack something.
std::vector<Evidence> why_incomplete(const RuleContext& context) {
  const auto& model = context.model;
  std::vector<Evidence> why;
  bool is_any = false;
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
    if (!model.processes[i].has_cie_events) continue;
    is_any = true;
    if (auto missing = context.proof.incompleteness(index)) why.push_back(*std::move(missing));
  }
  const auto begin = moment(model.begin);
  if (const auto& missing = context.proof.missing_user_part())
    why.push_back(evidence("missing_part", begin, free_text(*missing)));
  if (!is_any) why.push_back(without_event(begin, note("no-process-of-ours")));
  const auto lost = std::ranges::find_if(model.losses, [](const Loss& loss) {
    return loss.domain == Domain::user && loss.is_evidence;
  });
  if (lost != model.losses.end()) {
    why.push_back(without_event(moment(lost->begin), note("whole-process-perhaps-lost")));
  }
  if (std::ranges::any_of(recording_reports(model), begins_late)) {
    why.push_back(without_event(begin, note("earlier-chunks-not-read")));
  }
  return why;
}

// run_end has the total of what is missing.
std::vector<Evidence> missing(const RuleContext& context, Note what,
                              std::uint32_t RunTotals::*total, const char* all_seen) {
  const auto& model = context.model;
  std::vector<Evidence> witnesses{without_event(moment(model.begin), std::move(what))};
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (!context.proof.is_complete(ProcessIndex{static_cast<std::uint32_t>(i)})) continue;
    witnesses.push_back(evidence("run_end", process.run_end->at,
                                 note(all_seen, {{"total", (*process.run_end).*total}})));
  }
  return witnesses;
}

// One of them may have followed the other, as after a restart: not those of two machines, or of
// processes that lived at the same time.
bool are_lives_of_one(const RuleContext& context, const CallbackFacts& a, const CallbackFacts& b) {
  if (a.process == b.process) return true;
  const auto& processes = context.model.processes;
  if (processes[at(a.process)].host != processes[at(b.process)].host) return false;
  const auto is_over_before = [&](ProcessIndex one, ProcessIndex other) {
    return context.lives.last_sign(one) < latest_begin(processes[at(other)]);
  };
  return is_over_before(a.process, b.process) || is_over_before(b.process, a.process);
}

// Parameters that the spec has for a callback without a thread of its own: S1 judges none.
std::optional<Evidence> unapplied(const RuleContext& context, const CallbackFacts& callback) {
  const auto* entry = spec_entry(context, callback);
  const bool is_asked = entry != nullptr && judges_parameters(entry->parameters);
  if (!is_asked || callback.ran_on.empty() || is_never_read_back(callback)) return std::nullopt;
  if (!context.isolated.of(callback).empty()) return std::nullopt;
  const auto& model = context.model;
  const auto* first =
      *std::ranges::min_element(callback.ran_on, {}, [&model](const CallbackOnThread* pair) {
        return std::pair(pair->first_start.time, model.threads[at(pair->thread)].tid);
      });
  const auto& runs = model.threads[at(first->thread)].last_read_back;
  return evidence("not applied", first->first_start,
                  note("applied-to-no-thread",
                       {{"spec", place(context, entry->line)},
                        {"runs", runs ? note("thread-here-runs", {{"parameters", describe(*runs)}})
                                      : Note{}}}));
}

// ROS 2's events tell of a callback of that id in a process of this project, whose own do not.
std::optional<Evidence> beside_own(const Model& model, const std::string& id) {
  for (const auto& process : model.processes) {
    const auto found = process.beside_own.find(id);
    if (found == process.beside_own.end()) continue;
    const auto& ran = found->second;
    if (ran) {
      return evidence("callback_start", *ran, note("starts-in-another-executor"));
    }
    return without_event(process.first_seen.value_or(EventRef{}),
                         note("made-for-another-executor"));
  }
  return std::nullopt;
}

void judge_specified(const RuleContext& context, const Asked& asked,
                     const std::vector<CallbackIndex>& registered, Suggestions& suggestions,
                     std::vector<SubjectVerdict>& verdicts) {
  const auto& model = context.model;
  const auto judge = [&](NamedSubject subject, const CallbackFacts* callback) {
    Judgement judgement(std::move(subject), context.known);
    judgement.checked();
    if (callback != nullptr && known_instances(model, *callback) > 0) {
      if (auto remark = unapplied(context, *callback)) judgement.remark(*std::move(remark));
      conclude(std::move(judgement), verdicts);
      return;
    }
    const auto unseen = why_incomplete(context);
    if (callback != nullptr) {
      const bool is_of_ros2 = model.processes[at(callback->process)].is_from_ros2;
      std::vector witnesses{evidence(is_of_ros2 ? "" : "callback_init", *callback->registered,
                                     note("never-ran", {{"spec", asked.place}}))};
      if (callback->fini)
        witnesses.push_back(evidence("callback_fini", callback->fini->at, note("started-never")));
      judgement.violation_unless(unseen, std::move(witnesses));
    } else if (const auto beside = beside_own(model, asked.id)) {
      judgement.unseen(*beside);
    } else {
      judgement.violation_unless(
          unseen, missing(context,
                          note("never-registered",
                               {{"spec", asked.place},
                                {"meant", asked.is_entry ? suggestions.of_entry(asked.id)
                                                         : suggestions.of_member(asked.id)}}),
                          &RunTotals::callbacks, "all-callbacks-seen"));
    }
    conclude(std::move(judgement), verdicts);
  };
  if (registered.empty()) {
    judge(NamedSubject::without_row(SubjectKind::callback, asked.id), nullptr);
  }
  for (const auto index : registered) {
    const auto& callback = model.callbacks[at(index)];
    const auto is_excused_by = [&](CallbackIndex other) {
      const auto& life = model.callbacks[at(other)];
      return known_instances(model, life) > 0 && life.logical_id == callback.logical_id &&
             are_lives_of_one(context, callback, life);
    };
    // Of one callback's lifetimes one that ran is enough: the others need not have.
    const bool has_run = known_instances(model, callback) > 0;
    if (!has_run && std::ranges::any_of(registered, is_excused_by)) continue;
    judge(context.names.callback(index), &callback);
  }
}

// Each callback once: by its own entry, else by the first chain that it is a member of.
std::vector<Asked> callbacks_asked_for(const RuleContext& context) {
  const auto& spec = *context.options.spec;
  std::vector<Asked> asked;
  std::set<std::string_view> ids;
  for (const auto& entry : spec.callbacks()) {
    if (entry.is_wildcard()) continue;
    ids.insert(entry.id);
    asked.push_back({.id = entry.id, .place = place(context, entry.line), .is_entry = true});
  }
  for (const auto& chain : spec.chains()) {
    for (const auto& id : chain.callbacks) {
      if (!ids.insert(id).second) continue;
      asked.push_back({.id = id,
                       .place = "chain " + chain.name + ", " + place(context, chain.line),
                       .is_entry = false});
    }
  }
  return asked;
}

void judge_callbacks_specified(const RuleContext& context, std::vector<SubjectVerdict>& verdicts) {
  const auto asked = callbacks_asked_for(context);
  std::map<std::string_view, std::vector<CallbackIndex>> by_id;
  for (const auto index : context.callbacks) {
    const auto& callback = context.model.callbacks[at(index)];
    if (is_identified(callback)) by_id[callback.logical_id].push_back(index);
  }
  auto by_entry = by_id;  // timers with a name also by the entry of their period
  std::set<std::string_view> aliased;
  for (const auto index : context.callbacks) {
    const auto& callback = context.model.callbacks[at(index)];
    const auto* const entry = spec_entry(context, callback);
    if (entry == nullptr || entry->is_wildcard() || entry->id == callback.logical_id) continue;
    by_entry[entry->id].push_back(index);
    aliased.insert(callback.logical_id);
  }
  std::set<std::string_view> entries;
  for (const auto& each : asked) {
    if (each.is_entry) entries.insert(each.id);
  }
  std::vector<std::string> all;
  std::vector<std::string> without_entry;
  for (const auto& [id, lifetimes] : by_id) {
    all.emplace_back(id);
    if (!entries.contains(id) && !aliased.contains(id)) without_entry.emplace_back(id);
  }
  Suggestions suggestions(std::move(all), std::move(without_entry));
  const std::vector<CallbackIndex> none;
  for (const auto& each : asked) {
    const auto found = by_entry.find(each.id);
    judge_specified(context, each, found == by_entry.end() ? none : found->second, suggestions,
                    verdicts);
  }
}

// Those of DDS aside: which of its threads exist depends on how it is configured, and their names
// are known, so none is misspelt.
void judge_threads_specified(const RuleContext& context, std::vector<SubjectVerdict>& verdicts) {
  const auto& model = context.model;
  const auto& spec = *context.options.spec;
  std::set<std::string_view> announced;
  std::map<std::string_view, const ThreadFacts*> of_callbacks;
  for (const auto& thread : model.threads) {
    if (is_isolated(thread)) {
      of_callbacks.emplace(thread.name, &thread);
    } else if (thread.announced) {
      announced.insert(thread.name);
    }
  }
  announced.insert(model.later_threads.begin(), model.later_threads.end());
  std::vector<std::string> all(announced.begin(), announced.end());
  std::vector<std::string> without_entry;
  std::ranges::copy_if(all, std::back_inserter(without_entry), [&spec](const std::string& name) {
    return spec.find_thread(name) == nullptr;
  });
  Suggestions suggestions(std::move(all), std::move(without_entry));
  for (const auto& entry : spec.threads()) {
    if (entry.is_dds_thread) continue;
    Judgement judgement(NamedSubject::without_row(SubjectKind::thread, entry.id), context.known);
    judgement.checked();
    if (announced.contains(entry.id)) {
      conclude(std::move(judgement), verdicts);
      continue;
    }
    const auto found = of_callbacks.find(entry.id);
    judgement.violation_unless(
        why_incomplete(context),
        found != of_callbacks.end()
            ? std::vector{evidence(
                  "thread_init", *found->second->announced,
                  note("asked-of-callback-thread", {{"thread", thread_name(*found->second)},
                                                    {"spec", place(context, entry.line)}}))}
            : missing(context,
                      note("never-announced", {{"spec", place(context, entry.line)},
                                               {"meant", suggestions.of_entry(entry.id)}}),
                      &RunTotals::threads, "all-threads-seen"));
    conclude(std::move(judgement), verdicts);
  }
}

std::vector<SubjectVerdict> judge_specified_seen(const RuleContext& context) {
  std::vector<SubjectVerdict> verdicts;
  if (context.options.spec == nullptr) return verdicts;
  judge_callbacks_specified(context, verdicts);
  judge_threads_specified(context, verdicts);
  return verdicts;
}

}  // namespace

const Rule kSeqContiguous{
    .id = "T3",
    .name = "seq-contiguous",
    .meaning =
        "The numbers that each callback, publisher and thread counts its events with have no "
        "hole: nothing was lost silently. Of a callback both starts and ends are numbered; an "
        "instance that never ended has no end to lose. The first start of a callback carries the "
        "number its announcement promised; an end below the first start belongs to an instance "
        "that the recording's begin cut.",
    .why_it_matters =
        "A tracer's own count of losses can be wrong or missing; contiguous numbers cannot.",
    .inconclusive_when =
        "a number jumps: the hole is named, and every rule that judges each instance of that "
        "subject is INCONCLUSIVE as well.",
    .remedy = "see T2; after a copy, compare the files with the recording's manifest.",
    .judge = judge_seq_contiguous,
    .needs = {.is_about_trace = true, .is_of_report = true}};

const Rule kRunComplete{
    .id = "T4",
    .name = "run-complete",
    .meaning =
        "The process was seen from its run_begin to its run_end, and what it counted (callbacks, "
        "threads, groups, publishers, instances started and ended, messages, read-backs) is what "
        "the trace shows.",
    .why_it_matters =
        "That something did not happen can only be said of a recording that is known to be whole.",
    .inconclusive_when =
        "run_begin or run_end is missing (the process was still running when the recording ended, "
        "as in snapshots, chunks and where it was attached to; or it crashed, or executed another "
        "program; a process of ROS 2 alone has none), or a total differs from what was seen. "
        "--allow-crash accepts a process without a run_end, unless its recorder failed; the other "
        "rules judge what was seen.",
    .remedy =
        "start the recording before the application and end the application before the recording, "
        "or judge with --allow-crash; where it crashed, find out why.",
    .judge = judge_run_complete,
    .needs = {.is_about_trace = true, .is_of_report = true}};

const Rule kSpecifiedCallbackSeen{
    .id = kSpecifiedCallbackSeenRule,
    .name = "specified-callback-seen",
    .meaning =
        "Every callback that the scheduling spec names exactly, in an entry or in a chain, was "
        "registered and ran at least once (after a restart in one of its lifetimes, on several "
        "machines on each), and every thread of non_ros_threads was announced. <node>/* names none: where "
        "no callback of such a node was seen, the screens of cie verify and cie report tell it.",
    .why_it_matters =
        "A misspelt id configures nothing, and a chain with one is never judged, silently: what "
        "was meant runs with default parameters and without bounds.",
    .inconclusive_when =
        "it was not seen, and there is no proof that nothing is missing from the trace, or ROS "
        "2's events show that another executor has it.",
    .remedy =
        "write the id that \"did you mean\" suggests, or take ids from cie spec template; let the "
        "recording last until the callback has run; remove entries of what is gone.",
    .violation = "of the spec never ran as specified",
    .judge = judge_specified_seen,
    .needs = {.spec = true}};

}  // namespace cie::analysis
