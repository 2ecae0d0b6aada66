#include "ownership_rules.hpp"

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/subjects.hpp"
#include "thread_losses.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

ThreadIndex thread_index(std::size_t i) { return ThreadIndex{static_cast<std::uint32_t>(i)}; }

const EventRef& first_start_on(const ThreadFacts& thread) {
  return std::ranges::min_element(
             thread.ran, {}, [](const CallbackOnThread& pair) { return pair.first_start.time; })
      ->first_start;
}

// The spec's entry for a thread: that of its callback, or, for a worker, of its name.
const SpecEntry* spec_entry_of(const RuleContext& context, const ThreadFacts& thread) {
  if (context.options.spec == nullptr) return nullptr;
  if (thread.role == ThreadRole::worker) return context.options.spec->find_thread(thread.name);
  for (const auto& pair : thread.ran) {
    const auto& callback = context.model.callbacks[at(pair.callback)];
    if (is_registered_to(thread, callback)) return spec_entry(context, callback);
  }
  return nullptr;
}

void judge_foreign_callbacks(const Model& model, const ThreadFacts& thread, Judgement& judgement) {
  for (const auto& pair : thread.ran) {
    const auto& callback = model.callbacks[at(pair.callback)];
    judgement.check(pair.starts);
    if (is_registered_to(thread, callback)) continue;
    if (!callback.registered && !thread.callback) continue;  // perhaps of its group
    judgement.fail(evidence(
        "thread_init", *thread.announced,
        "announced for callback " + (thread.callback ? std::to_string(to_number(*thread.callback))
                                                     : std::string("of its group"))));
    judgement.fail(evidence("callback_start", pair.first_start,
                            "started " + callback.logical_id + " (seq " +
                                std::to_string(pair.first_seq) + "), which is not its own"));
  }
}

void judge_foreign_time(const Model& model, const Proof& proof, const ThreadFacts& thread,
                        const SpecEntry& entry, const std::string& where,
                        const std::optional<Evidence>& lost, Judgement& judgement) {
  const EventRef end = moment(lifetime(thread).second, thread.tid);
  if (lost) {  // what lost instances did would count as foreign work; or its time is another one
    judgement.doubt(lost);
    return;
  }
  if (thread.kernel_exit && !thread.fini) {
    judgement.doubt(evidence("thread_fini", *thread.kernel_exit,
                             "it exits, and the end of its work was not seen"));
    return;
  }
  const auto budget = *entry.foreign_work_budget_ns;
  const auto host = model.processes[at(thread.process)].host;
  const auto loss = thread.first_wait ? proof.kernel_loss(host, *thread.first_wait, end.time)
                                      : proof.kernel_loss(thread);
  if (loss) {
    judgement.doubt(loss);
    return;
  }
  if (!thread.foreign_ns || !thread.foreign_span_ns || !thread.first_wait) {
    const bool has_switches = model.hosts[at(host)].has_switches;
    judgement.doubt(evidence(
        "sched_switch", end,
        has_switches ? "on-CPU time outside callbacks is not known without gap"
                     : "no sched_switch events; record with --kernel to measure foreign work"));
    return;
  }
  judgement.check();
  // foreign / span > budget / second, in whole nanoseconds.
  const bool is_above = static_cast<Int128>(*thread.foreign_ns) * 1'000'000'000 >
                        static_cast<Int128>(budget) * *thread.foreign_span_ns;
  if (!is_above) return;
  judgement.fail(evidence("sched_switch", moment(*thread.first_wait, thread.tid),
                          "first wait: foreign work is counted from here"));
  judgement.fail(evidence("sched_switch", end,
                          nanoseconds(*thread.foreign_ns) + " on a CPU outside callbacks within " +
                              nanoseconds(*thread.foreign_span_ns) + "; " + where + " allows " +
                              nanoseconds(budget) + " per second"));
}

std::vector<SubjectVerdict> judge_foreign_work(const RuleContext& context) {
  const auto& model = context.model;
  const Proof proof(model);
  const auto unknown = unknown_threads(model, proof);
  const ThreadLosses losses(model, proof);
  auto verdicts =
      judge_threads(model, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        if (const auto found = unknown.find(index); found != unknown.end()) {
          judgement.doubt(found->second);
        }
        const bool is_worker = thread.announced && thread.role == ThreadRole::worker;
        if (is_isolated(thread)) {
          judge_foreign_callbacks(model, thread, judgement);
          judgement.doubt(losses.on(index));
        }
        if (is_isolated(thread) || is_worker) {
          const auto* entry = spec_entry_of(context, thread);
          if (entry != nullptr && entry->foreign_work_budget_ns) {
            judge_foreign_time(model, proof, thread, *entry, place(context, entry->line),
                               proof.loss(index) ? proof.loss(index) : losses.on(index), judgement);
          }
        }
      });
  note_missing_vtid(model, verdicts);
  return verdicts;
}

void judge_group(const Model& model, const GroupFacts& group,
                 const std::vector<ThreadIndex>& threads, Judgement& judgement) {
  judgement.check(group.callbacks.size());
  const auto witness = [&](const std::string& note) {
    judgement.fail(evidence("group_init", group.first_seen, note));
    for (const auto index : threads) {
      const auto& thread = model.threads[at(index)];
      judgement.fail(evidence("thread_init", *thread.announced,
                              "isolated thread " + std::to_string(thread.tid) + " serves it"));
    }
    for (const auto index : group.callbacks) {
      const auto& callback = model.callbacks[at(index)];
      judgement.fail(
          evidence("callback_init", *callback.registered, callback.logical_id + " belongs to it"));
    }
  };
  if (group.type == GroupType::reentrant) witness("a reentrant group");
  if (group.callbacks.size() >= 2) {
    witness("a group of " + std::to_string(group.callbacks.size()) + " callbacks");
  }
  if (!group.type) {
    judgement.doubt(evidence("group_init", group.first_seen, "the group was never announced"));
  }
  if (group.callbacks.empty()) {
    judgement.doubt(evidence("callback_init", group.first_seen,
                             "no callback of the group was seen to be registered"));
  }
}

// A callback that was never registered: it may belong to any group of its process.
std::optional<Evidence> unknown_member(const Model& model, ProcessIndex process) {
  const auto found =
      std::ranges::find_if(model.callbacks, [process](const CallbackFacts& callback) {
        return callback.process == process && !callback.registered;
      });
  if (found == model.callbacks.end()) return std::nullopt;
  return evidence("callback_init", first_sign(*found),
                  found->logical_id + " was never registered: its group is unknown");
}

std::vector<SubjectVerdict> judge_groups(const RuleContext& context) {
  const auto& model = context.model;
  const Subjects names(model);
  const Proof proof(model);
  const IsolatedThreads isolated(model);
  // Groups whose thread is not known to be isolated or not.
  std::map<std::pair<ProcessIndex, GroupId>, Evidence> unknown;
  for (const auto& [index, reason] : unknown_threads(model, proof)) {
    for (const auto& pair : model.threads[at(index)].ran) {
      const auto& callback = model.callbacks[at(pair.callback)];
      if (callback.group) unknown.try_emplace({callback.process, *callback.group}, reason);
    }
  }
  std::vector<SubjectVerdict> verdicts;
  std::set<std::pair<ProcessIndex, GroupId>> seen;
  for (std::size_t i = 0; i < model.groups.size(); ++i) {
    const auto& group = model.groups[i];
    seen.insert({group.process, group.id});
    const auto threads = isolated.of(group);
    Judgement judgement(names.group(GroupIndex{static_cast<std::uint32_t>(i)}));
    if (!threads.empty()) {
      judge_group(model, group, threads, judgement);
      judgement.doubt(proof.unseen_callbacks(group.process));
      judgement.doubt(unknown_member(model, group.process));
    }
    if (const auto found = unknown.find({group.process, group.id}); found != unknown.end()) {
      judgement.doubt(found->second);
    }
    conclude(std::move(judgement), verdicts);
  }
  for (const auto& thread : model.threads) {
    if (!is_isolated(thread) || (thread.group && seen.contains({thread.process, *thread.group}))) {
      continue;
    }
    const auto id = thread.group.value_or(kNoGroup);
    if (thread.group) seen.insert({thread.process, id});
    Judgement judgement(names.group(thread.process, id));
    judgement.doubt(evidence(
        "group_init", *thread.announced,
        "the group of isolated thread " + std::to_string(thread.tid) + " was never announced"));
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

// In a process that ended in order every thread tells its end, unless it was replaced: what of a
// callback that stayed with it came after that?
bool is_end_lost(const Model& model, const ThreadFacts& thread) {
  if (thread.fini || !model.processes[at(thread.process)].run_end) return false;
  return std::ranges::any_of(thread.ran, [&model](const CallbackOnThread& pair) {
    const auto& threads = model.callbacks[at(pair.callback)].ran_on;
    return std::ranges::all_of(threads, [&pair](const CallbackOnThread& other) {
      return other.last_activity.time <= pair.last_activity.time;
    });
  });
}

std::vector<SubjectVerdict> judge_known(const RuleContext& context) {
  const auto& model = context.model;
  const Proof proof(model);
  auto verdicts = judge_threads(model, [&](ThreadIndex, const ThreadFacts& thread,
                                           Judgement& judgement) {
    if (thread.ran.empty()) return;
    for (const auto& pair : thread.ran)
      judgement.check(pair.starts);
    if (thread.announced) {
      if (is_end_lost(model, thread)) {
        judgement.doubt(evidence("thread_fini", model.processes[at(thread.process)].run_end->at,
                                 "the end of thread " + std::to_string(thread.tid) +
                                     " was not seen: callbacks may have started after it"));
      }
      return;
    }
    judgement.overrule(proof.incompleteness(thread.process));
    if (thread.former_fini) {
      judgement.fail(evidence("thread_fini", *thread.former_fini,
                              "the thread of this tid ends its work for callbacks"));
    }
    const auto& first = first_start_on(thread);
    judgement.fail(evidence("callback_start", first, "a callback ran here, first at this time"));
    if (const auto& end = model.processes[at(thread.process)].run_end) {
      judgement.fail(evidence("run_end", end->at,
                              "all " + std::to_string(end->threads) +
                                  " announced threads were seen; this one was not announced"));
    }
  });
  note_missing_vtid(model, verdicts);
  return verdicts;
}

}  // namespace

std::map<ThreadIndex, Evidence> unknown_threads(const Model& model, const Proof& proof) {
  std::map<ThreadIndex, Evidence> unknown;
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto& thread = model.threads[i];
    if (thread.announced || thread.ran.empty() || proof.is_complete(thread.process)) continue;
    unknown.emplace(thread_index(i),
                    evidence("thread_init", first_start_on(thread),
                             "thread " + std::to_string(thread.tid) +
                                 (thread.former_fini
                                      ? " was not seen to be announced again after its thread_fini"
                                      : " was never seen to be announced") +
                                 ": its role is unknown"));
  }
  return unknown;
}

const Rule kNoForeignWork{
    "M6",
    "no-foreign-work",
    "An isolated thread works for its own callback alone: it starts no other, and its work "
    "outside callbacks stays within foreign_work_budget (nanoseconds per second; without one it "
    "is not judged).\n"
    "Why it matters: Work that no callback accounts for delays the callback at its own "
    "priority, and no analysis of callbacks sees it.\n"
    "Inconclusive when a callback on it lost instances, the context vtid is absent, or (for the "
    "budget) there are no kernel events, their record has a hole, or read-backs or the end of the "
    "thread were lost.\n"
    "Remedy: register the callback to the thread that runs it; move other work to a thread of "
    "its own (Executor::spawn_thread); record with --kernel.",
    judge_foreign_work,
    {.instances = true}};

const Rule kSingleCallbackGroup{
    "M8", "single-callback-group",
    "The group of an isolated thread has one callback, and is not reentrant.\n"
    "Why it matters: Callbacks of one group share its thread and so wait for each other, "
    "although each looks isolated in the configuration; a reentrant group needs several "
    "threads.\n"
    "Inconclusive when the group, or the callbacks in it, were never announced.\n"
    "Remedy: create each callback with a callback group of its own, which is the default, "
    "instead of handing several the same one.",
    judge_groups};

const Rule kThreadKnown{
    "M9",
    "thread-known",
    "Every thread that ran a callback was announced by the executor, and runs none after its "
    "thread_fini unless it is announced anew (it may still publish).\n"
    "Why it matters: Of a thread that nobody announced nobody knows the role or applied "
    "parameters: its callbacks run by chance.\n"
    "Inconclusive when no announcement was seen, and there is no proof that nothing is missing, when "
    "the thread_fini of a thread that was not replaced was lost, or the context vtid is absent.\n"
    "Remedy: run callbacks from the executor's threads only; call no callback from a thread of "
    "your own.",
    judge_known,
    {.instances = true}};

}  // namespace cie::analysis
