#include "parameter_rules.hpp"

#include <cie/analysis/note.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "parameter_words.hpp"
#include "parameters_in_force.hpp"
#include "scheduled_parameters.hpp"
#include "spec_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

namespace cie::analysis {
namespace {

// Callbacks that ran on threads of which it is unknown whether they are isolated.
std::map<CallbackIndex, const Evidence*> on_unknown_threads(const RuleContext& context) {
  std::map<CallbackIndex, const Evidence*> callbacks;
  for (const auto& [index, reason] : context.unknown_threads) {
    for (const auto* pair : context.model.threads[at(index)].ran)
      callbacks.try_emplace(pair->callback, &reason);
  }
  return callbacks;
}

bool asks_for_parameters(const SpecEntry& entry) { return judges_parameters(entry.parameters); }

bool asks_for_any(const std::vector<SpecEntry>& entries) {
  return std::ranges::any_of(entries, asks_for_parameters);
}

// Whether the spec has an entry for a callback cannot be told without its registration.
void doubt_identity(const RuleContext& context, const CallbackFacts& callback,
                    Judgement& judgement) {
  if (is_identified(callback)) {
    judgement.unseen(unknown_former(context, callback, asks_for_parameters));
    return;
  }
  judgement.unseen(
      without_event(first_sign(context.model, callback),
                    note("asked-parameters-unknown", {{"text", why_unidentified(callback)}})));
}

bool is_judged_by(const RuleContext& context, const LoadedSpec& loaded) {
  return loaded.sha256 == context.options.spec->sha256();
}

// The spec of the process then. Null: it was not told yet.
const LoadedSpec* spec_then(const ProcessFacts& process, Timestamp time) {
  const LoadedSpec* then = nullptr;
  for (const auto& loaded : process.specs) {
    if (loaded.since <= time) then = &loaded;
  }
  return then;
}

// The process was told then that it had the spec that is judged by.
bool is_judged_by_spec_at(const RuleContext& context, const ProcessFacts& process, Timestamp time) {
  const auto* then = spec_then(process, time);
  return then != nullptr && is_judged_by(context, *then);
}

// Null: its run_begins name none.
const LoadedSpec* last_named_spec(const ProcessFacts& process) {
  const auto named =
      std::ranges::find_if(process.specs.rbegin(), process.specs.rend(),
                           [](const auto& loaded) { return !loaded.sha256.empty(); });
  return named == process.specs.rend() ? nullptr : &*named;
}

// The thread ended before its process was given the spec that is judged by, and that was not the
// one that the process had until then.
bool ended_with_former_spec(const RuleContext& context, const ThreadFacts& thread,
                            const std::optional<EventRef>& fini) {
  const auto& process = context.model.processes[at(thread.process)];
  if (!fini) return false;
  const auto* last_named = last_named_spec(process);
  if (last_named == nullptr || !is_judged_by(context, *last_named)) return false;
  if (fini->time >= last_named->since) return false;
  return !is_judged_by_spec_at(context, process, fini->time);
}

// What was applied is what another spec than the one that is judged by asked for. A request that
// failed tells not whose it was: the process names the spec of one executor, and another one's
// thread may have had another one.
bool is_by_another_spec(const RuleContext& context, const ThreadFacts& thread,
                        const ReadBack& applied, const ThreadParameters& asked) {
  if (applied.error != 0) return false;
  if (was_asked_otherwise(applied, asked)) return true;
  const auto* then = spec_then(context.model.processes[at(thread.process)], applied.at.time);
  return then != nullptr && !is_judged_by(context, *then) &&
         !context.user_losses.between(thread.process, Timestamp{}, applied.at.time);
}

// Of a thread that ended with a former spec, which owes the later one nothing.
void judge_former(const RuleContext& context, ThreadIndex index, const ReadBack& applied,
                  Timestamp end, const SpecEntry& entry, Judgement& judgement) {
  judgement.needs_none(context.known.other_parameters(index, applied));
  const auto& thread = context.model.threads[at(index)];
  if (is_as_specified(applied, entry.parameters) == true) return;
  const bool is_spec_told =
      spec_then(context.model.processes[at(thread.process)], end) != nullptr &&
      !context.user_losses.between(thread.process, Timestamp{}, end);
  if (is_spec_told && is_by_another_spec(context, thread, applied, entry.parameters)) return;
  judgement.unseen(
      evidence("thread_sched", applied.at,
               note("ran-perhaps-by-another-spec", {{"asked", asks(context, entry)},
                                                    {"parameters", describe(applied)},
                                                    {"failure", failure_of(applied)}})));
}

// Its process was told of a spec behind the end of the thread, and what told of another one before
// may be lost; or what told of the one that is judged by, for no event names that.
std::optional<Evidence> doubt_of_spec(const RuleContext& context, const ThreadFacts& thread,
                                      const std::optional<EventRef>& fini) {
  const auto& process = context.model.processes[at(thread.process)];
  if (!fini) {  // or unseen
    return process.specs.empty() ? context.proof.unseen_announcement(thread.process) : std::nullopt;
  }
  if (!is_judged_by_spec_at(context, process, fini->time)) {
    if (auto unseen = context.proof.unseen_announcement(thread.process)) return unseen;
  }
  if (process.last_begin > fini->time) {
    return context.user_losses.between(thread.process, Timestamp{}, process.last_begin);
  }
  const auto* last = last_named_spec(process);
  if (last != nullptr && is_judged_by(context, *last)) return std::nullopt;
  return context.user_losses.since(thread.process, fini->time);
}

// By what was applied while the thread was announced for the callback; empty: at any time.
void judge_as_specified(const RuleContext& context, ThreadIndex index,
                        std::optional<CallbackIndex> of, const SpecEntry& entry,
                        Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const auto* callback = of ? &context.model.callbacks[at(*of)] : nullptr;
  const auto own = announcement_of(thread, callback);
  const auto* applied = callback != nullptr ? last_applied(context.model, thread, *callback)
                                            : last_applied(context.model, thread);
  if (applied == nullptr) {
    judgement.unseen(evidence("thread_init", thread.former.empty() ? *thread.announced : own.at,
                              note(thread.former.empty() ? "no-applied-parameters"
                                                         : "no-applied-parameters-of-announcement",
                                   {{"tid", thread.tid}})));
    return;
  }
  if (ended_with_former_spec(context, thread, own.fini)) {
    judge_former(context, index, *applied, own.fini->time, entry, judgement);
    return;
  }
  judgement.checked();
  judge_started_otherwise(context, index, of, entry, judgement);
  if (judgement.has_witness()) return;
  const auto others = context.known.other_parameters(index, *applied);
  judgement.needs_none(others);
  const auto change = unended_change(context.model, thread, own);
  judgement.unseen(change);
  const auto is_right = is_as_specified(*applied, entry.parameters);
  if (!is_right) {
    judgement.unseen(evidence("thread_sched", applied->at,
                              note("recording-too-old", {{"asked", asks(context, entry)},
                                                         {"parameters", describe(*applied)}})));
    return;
  }
  if (*is_right) return;
  const auto runs = describe(*applied);
  const auto is_unlike = [&runs](const ReadBack& later) { return describe(later) != runs; };
  const auto& last = thread.last_read_back;
  const bool differs_later = last && own.holds(*last) && last->n > applied->n && is_unlike(*last);
  auto unlike = note(differs_later ? "applied-unlike-asked" : "runs-unlike-asked",
                     {{"asked", asks(context, entry)},
                      {"parameters", runs},
                      {"change", since_change(*applied)},
                      {"failure", failure_of(*applied)}});
  if (differs_later) unlike.arguments.emplace_back("later", describe(*last));
  judgement.violation_unless(listed({change, doubt_of_spec(context, thread, own.fini)}),
                             {evidence("thread_sched", applied->at, std::move(unlike))}, others);
}

// Threads whose announcement was lost may have been anybody's.
std::map<ProcessIndex, const Evidence*> unannounced_threads(const RuleContext& context) {
  std::map<ProcessIndex, const Evidence*> found;
  for (std::size_t i = 0; i < context.model.threads.size(); ++i) {
    const auto& thread = context.model.threads[i];
    const auto& loss = context.proof.loss(ThreadIndex{static_cast<std::uint32_t>(i)});
    if (!thread.announced && loss) found.try_emplace(thread.process, &*loss);
  }
  return found;
}

std::vector<SubjectVerdict> judge_named_threads(const RuleContext& context) {
  if (!asks_for_any(context.options.spec->threads())) return {};
  return judge_threads(context,
                       [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
                         if (!thread.announced) {
                           judgement.unseen(context.proof.loss(index));
                         } else {
                           const auto* entry = entry_of_name(context, thread);
                           if (entry != nullptr && judges_parameters(entry->parameters)) {
                             judge_as_specified(context, index, std::nullopt, *entry, judgement);
                           }
                         }
                       });
}

// A callback that has a thread of its own ran on another one all the same, as a worker or one of a pool.
void judge_ran_elsewhere(const RuleContext& context, const CallbackFacts& callback,
                         const SpecEntry& entry, Judgement& judgement) {
  for (const auto* pair : callback.ran_on) {
    const auto index = pair->thread;
    const auto& thread = context.model.threads[at(index)];
    if (!is_of_other_role(thread) || !is_there_for_certain(context.model, *pair)) continue;
    judgement.checked();
    const auto elsewhere =
        evidence("callback_start", pair->first_start,
                 note("ran-elsewhere", {{"callback", NamedCallback{callback.logical_id}},
                                        {"times", pair->starts},
                                        {"thread", thread_name(thread)}}));
    const auto& runs = thread.last_read_back;
    const auto is_right = runs ? is_as_specified(*runs, entry.parameters) : std::nullopt;
    if (!is_right) {
      judgement.unseen(elsewhere);
    } else if (!*is_right) {
      judgement.violation(std::vector{elsewhere, evidence("thread_sched", runs->at,
                                                          note("elsewhere-unlike-asked",
                                                               {{"asked", asks(context, entry)},
                                                                {"parameters", describe(*runs)}}))},
                          context.known.read_backs(index, runs->at.time));
    }
  }
}

std::vector<SubjectVerdict> judge_specified(const RuleContext& context) {
  if (context.options.spec == nullptr) return {};
  const auto unknown = on_unknown_threads(context);
  const auto unannounced = unannounced_threads(context);
  const bool asks_any = asks_for_any(context.options.spec->callbacks());
  auto verdicts = judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (asks_any) doubt_identity(context, callback, judgement);
        const auto* entry = spec_entry(context, callback);
        if (entry != nullptr && judges_parameters(entry->parameters)) {
          if (is_never_read_back(callback)) {
            judge_scheduled(context, callback, *entry, judgement);
            return;
          }
          const auto threads = context.isolated.of(callback);
          if (const auto found = unknown.find(index); found != unknown.end()) {
            judgement.unseen(*found->second);
          }
          const auto lost = unannounced.find(callback.process);
          if (threads.empty() && lost != unannounced.end()) judgement.unseen(*lost->second);
          for (const auto thread : threads) {
            judge_as_specified(context, thread, index, *entry, judgement);
          }
          if (!threads.empty()) judge_ran_elsewhere(context, callback, *entry, judgement);
        }
      });
  std::ranges::move(judge_named_threads(context), std::back_inserter(verdicts));
  return verdicts;
}

// Of a callback with threads of its own: the one that seq 0 ran on, or else the first one announced for it.
std::optional<ThreadIndex> thread_of_first_instance(const CallbackFacts& callback,
                                                    const std::vector<ThreadIndex>& isolated) {
  if (isolated.empty()) return std::nullopt;
  const auto ran = std::ranges::find(callback.ran_on, 0U, &CallbackOnThread::first_seq);
  return ran != callback.ran_on.end() ? (*ran)->thread : isolated.front();
}

// The parameters came with a change, as of a reload, after the callback's first start: did that run
// as another spec said?
void judge_changed(const RuleContext& context, ThreadIndex index, const CallbackFacts& callback,
                   const EventRef& first_start, const ReadBack& match, const SpecEntry& entry,
                   Judgement& judgement) {
  judgement.needs_none(context.known.read_backs(index, kEarliest, match.at.time));
  const auto& thread = context.model.threads[at(index)];
  const auto own = announcement_of(thread, &callback);
  const ReadBack* former = nullptr;
  for (const auto& applied : thread.applied) {
    if (own.holds(applied) && applied.at.time <= first_start.time) former = &applied;
  }
  if (former != nullptr && is_by_another_spec(context, thread, *former, entry.parameters)) return;
  auto before = former == nullptr ? Note{}
                                  : note("ran-before", {{"parameters", describe(*former)},
                                                        {"failure", failure_of(*former)}});
  judgement.unseen(evidence("thread_sched", match.at,
                            note("parameters-came-with-change",
                                 {{"change", match.change}, {"before", std::move(before)}})));
}

// The callback started first on the thread before the parameters that match.
void fail_unconfigured(const RuleContext& context, ThreadIndex index, const CallbackFacts& callback,
                       const EventRef& first_start, std::uint64_t seq, const ReadBack& match,
                       Judgement& judgement) {
  judgement.checked();
  // What ran under another announcement counts there, too.
  const bool is_counted = context.model.threads[at(index)].former.empty();
  auto how_many =
      is_counted
          ? note("as-many-did", {{"instances", std::max<std::uint64_t>(match.starts_before, 1)}})
          : Note{};
  judgement.violation(
      std::vector{evidence("callback_start", first_start,
                           note("instance-started-unconfigured",
                                {{"callback", NamedCallback{callback.logical_id}},
                                 {"seq", seq},
                                 {"how_many", std::move(how_many)}})),
                  evidence("thread_sched", match.at,
                           note("runs-as-specified-only-now", {{"parameters", describe(match)}}))},
      context.known.read_backs(index, kEarliest, match.at.time));
}

// While the thread was announced for the callback.
std::vector<ReadBack>::const_iterator first_match(const ThreadFacts& thread,
                                                  const CallbackFacts& callback,
                                                  const SpecEntry& entry) {
  const auto own = announcement_of(thread, &callback);
  return std::ranges::find_if(thread.applied, [&](const ReadBack& read_back) {
    return own.holds(read_back) && is_as_specified(read_back, entry.parameters) == true;
  });
}

// A thread that took the place of the one that ran the callback first: parameters that came too late are a witness. Its
// first start may be what was lost, so none that came in time is one.
void judge_before_next(const RuleContext& context, ThreadIndex index, const CallbackFacts& callback,
                       const SpecEntry& entry, Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const auto ran = std::ranges::find(callback.ran_on, index, &CallbackOnThread::thread);
  const auto match = first_match(thread, callback, entry);
  const bool is_judged = ran != callback.ran_on.end() && (*ran)->starts > 0 &&
                         match != thread.applied.end() && match->change == 0;
  if (!is_judged || (*ran)->first_start.time >= match->at.time) return;
  fail_unconfigured(context, index, callback, (*ran)->first_start, (*ran)->first_seq, *match,
                    judgement);
}

void judge_before_first(const RuleContext& context, ThreadIndex index, CallbackIndex callback_index,
                        const SpecEntry& entry, Judgement& judgement) {
  const auto& model = context.model;
  const auto& thread = model.threads[at(index)];
  const auto& callback = model.callbacks[at(callback_index)];
  const bool is_attached =
      model.processes[at(callback.process)].first_moment == RunMoment::announce;
  const auto& starts = callback.starts;
  if (!starts.first) {
    judgement.needs(context.known.lost_run(callback_index));
    return;
  }
  if (*starts.first != 0) {
    // Before the window, if the announcement came later than it; lost, if it was promised.
    const bool is_promised = callback.registered && callback.first_next_seq == 0;
    if (!is_attached || is_promised) judgement.needs(context.known.lost_run(callback_index));
    return;
  }
  const auto match = first_match(thread, callback, entry);
  if (match == thread.applied.end()) {
    const bool is_audited = is_attached && thread.applied.empty() && thread.first_audit &&
                            is_as_specified(*thread.first_audit, entry.parameters) == true;
    if (is_audited && starts.first_at.time >= thread.first_audit->at.time) judgement.checked();
    if (!is_audited) judgement.needs_none(context.known.read_backs(index));
    return;
  }
  if (starts.first_at.time >= match->at.time) {
    judgement.checked();
  } else if (match->change != 0) {
    judge_changed(context, index, callback, starts.first_at, *match, entry, judgement);
  } else {
    fail_unconfigured(context, index, callback, starts.first_at, 0, *match, judgement);
  }
}

std::vector<SubjectVerdict> judge_before(const RuleContext& context) {
  if (context.options.spec == nullptr) return {};
  const auto unknown = on_unknown_threads(context);
  const bool asks_any = asks_for_any(context.options.spec->callbacks());
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (asks_any) doubt_identity(context, callback, judgement);
        const auto* entry = spec_entry(context, callback);
        if (entry == nullptr || !judges_parameters(entry->parameters)) return;
        if (is_never_read_back(callback)) {
          judge_scheduled_before(context, index, *entry, judgement);
          return;
        }
        if (const auto found = unknown.find(index); found != unknown.end()) {
          judgement.unseen(*found->second);
        }
        if (unknown.contains(index)) return;
        const auto threads = context.isolated.of(callback);
        const auto first = thread_of_first_instance(callback, threads);
        if (first) judge_before_first(context, *first, index, *entry, judgement);
        for (const auto thread : threads) {
          if (thread != first) judge_before_next(context, thread, callback, *entry, judgement);
        }
      });
}

}  // namespace

const Rule kParametersAsSpecified{
    .id = "S1",
    .name = "parameters-as-specified",
    .meaning =
        "What the kernel reported when a thread's parameters were last applied is what the spec "
        "asks for: policy, priority or nice, deadline triple, time slice, utilization clamps, "
        "CPUs; and so is, for each instance, what was read back last before it started, from the "
        "first read-back on that matches. What a process ran as while it had another spec, as it "
        "told, owes this one nothing. After a reload the spec to judge by is the new one; threads that ended before, "
        "under another one, owe it nothing. On a process that was attached to, the first audit "
        "stands for it. Where a callback ran on another thread than its own, what that was read "
        "back to run as is judged, too. A callback that has none of its own, as in a pool, is not "
        "judged, and the summary says so. Of a thread that is announced anew for another callback "
        "what was applied under the callback's own announcement counts.",
    .why_it_matters =
        "A refused or forgotten request leaves the thread with other parameters than planned, and "
        "every analysis of the plan is void.",
    .inconclusive_when =
        "there is no such read-back, a later one may have been lost, or one since the first that "
        "matched, or one before that first audit, a change of the parameters began that was not "
        "seen to end, the recording is too old to carry what is asked for, or the request of a thread "
        "that ended before a reload failed (its executor may have had the spec before); and of a "
        "thread that ended where another spec may be unseen, as something of its process was "
        "never announced. Recordings that never read back (ros2 trace) are judged by the "
        "priorities and CPUs of sched_switch.",
    .remedy =
        "an errno in the evidence says why a request failed (EPERM: CAP_SYS_NICE or a limit; EBUSY: "
        "the admission test of SCHED_DEADLINE; EINVAL: values, cpuset); without one, find out "
        "whether something else was asked for, or asked for later; judge by the spec that the "
        "application was started with.",
    .remedy_rclcpp =
        "look whether what configures the threads was refused (CAP_SYS_NICE, rtprio limits and "
        "cpusets are the usual causes); judge by the spec that it was given.",
    .violation = "did not run as specified",
    .judge = judge_specified,
    .needs = {.spec = true}};

const Rule kParametersBeforeFirstCallback{
    .id = "S2",
    .name = "parameters-before-first-callback",
    .meaning =
        "A thread was configured before its callback ran for the first time (seq 0), and one that "
        "took its place before it ran there; the evidence counts the instances that ran "
        "unconfigured. Not judged where parameters came with a change and the thread ran as "
        "another spec said before.",
    .why_it_matters =
        "The first instances after a start are often the longest ones, and without their "
        "parameters they are late or delay others.",
    .inconclusive_when =
        "the first start, or an earlier read-back (a switch, where nobody reads back), may have "
        "been lost, or parameters came with a change and the request before it failed (of which "
        "spec it was is not told).",
    .remedy =
        "let the application apply the spec itself before it spins; configurators outside the "
        "process come too late by nature.",
    .violation = "got parameters too late",
    .judge = judge_before,
    .needs = {.spec = true}};

}  // namespace cie::analysis
