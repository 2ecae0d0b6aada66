#include "ownership_rules.hpp"

#include <cie/analysis/note.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "scheduled_parameters.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// Who is known to have lived at a time had not ended then.
constexpr Duration kInstant{1};

// Until when the callback lived, as far as is proven: nothing proves that an end that was not seen did not
// come right after its last sign.
Timestamp known_end(const CallbackFacts& callback) {
  if (callback.fini) return callback.fini->at.time;
  const auto told = callback.last_told.value_or(callback.registered->time);
  return std::max(last_sign(callback).time, told) + kInstant;
}

// Both were announced when a session attached: what is announced lives.
bool are_announced_together(const CallbackFacts& one, const CallbackFacts& other) {
  return one.may_repeat && other.may_repeat &&
         one.announcements_at_init == other.announcements_at_init;
}

// How many of the group's callbacks lived at the same time, at most: one that was made after another
// was destroyed takes its place.
std::size_t most_alive(const RuleContext& context, const std::vector<CallbackIndex>& callbacks) {
  const auto& model = context.model;
  std::multiset<Timestamp> ends;  // of those alive
  std::size_t most = 0;
  if (callbacks.empty()) return most;
  const auto& last = model.callbacks[at(callbacks.back())];
  for (const auto index : callbacks) {  // as they were registered
    const auto& callback = model.callbacks[at(index)];
    ends.erase(ends.begin(), ends.upper_bound(callback.registered->time));
    auto end = known_end(callback);
    if (are_announced_together(callback, last))
      end = std::max(end, last.registered->time + kInstant);
    ends.insert(end);
    most = std::max(most, ends.size());
  }
  return most;
}

// The first one of which no end is known while others follow; null: there is none.
const CallbackFacts* unended_of_several(const RuleContext& context,
                                        const std::vector<CallbackIndex>& callbacks) {
  for (std::size_t i = 0; i + 1 < callbacks.size(); ++i) {
    const auto& callback = context.model.callbacks[at(callbacks[i])];
    if (!callback.fini) return &callback;
  }
  return nullptr;
}

// " of /car: /car@Timer(10), /car@Subscription(/scan)": whose it is and what it holds.
Note what_it_holds(const Model& model, const GroupFacts& group,
                   const std::vector<CallbackIndex>& callbacks) {
  constexpr std::size_t kNamed = 3;
  Note held;
  if (callbacks.size() > kNamed) held = note("and-more", {{"more", callbacks.size() - kNamed}});
  for (auto i = std::min(kNamed, callbacks.size()); i-- > 0;) {
    held = note(i == 0 ? "holds" : "and-holds",
                {{"callback", NamedCallback{model.callbacks[at(callbacks[i])].logical_id}},
                 {"others", std::move(held)}});
  }
  const auto node = std::ranges::find_if(model.nodes, [&group](const NodeFacts& facts) {
    return facts.process == group.process && facts.id == group.node;
  });
  if (node == model.nodes.end()) return held;
  return note("of-node-holds", {{"node", node->name}, {"held", std::move(held)}});
}

void judge_group(const RuleContext& context, const GroupFacts& group,
                 const std::vector<ThreadIndex>& threads, Judgement& judgement) {
  const auto& model = context.model;
  auto callbacks = group.callbacks;
  std::erase_if(callbacks, [&](CallbackIndex index) {
    return context.is_after_window(model.callbacks[at(index)]);
  });
  judgement.checked(callbacks.size());
  const auto witness = [&](Note what) {
    what.arguments.emplace_back("held", what_it_holds(model, group, callbacks));
    std::vector witnesses{evidence("group_init", group.first_seen, std::move(what))};
    for (const auto index : threads) {
      const auto& thread = model.threads[at(index)];
      witnesses.push_back(evidence("thread_init", *thread.announced,
                                   note("isolated-thread-serves-it", {{"tid", thread.tid}})));
    }
    for (std::size_t i = 0; i < std::min(callbacks.size(), Judgement::kMaxEvidence); ++i) {
      const auto& callback = model.callbacks[at(callbacks[i])];
      witnesses.push_back(
          evidence("callback_init", *callback.registered,
                   note("belongs-to-it", {{"callback", NamedCallback{callback.logical_id}}})));
    }
    judgement.violation(std::move(witnesses));
  };
  if (group.type == GroupType::reentrant) witness(note("reentrant-group"));
  if (const auto most = most_alive(context, callbacks); most >= 2) {
    witness(note("group-of-several", {{"callbacks", most}}));
  } else if (const auto* unended = unended_of_several(context, callbacks)) {
    judgement.unseen(evidence(
        "callback_init", *unended->registered,
        note("perhaps-lived-with-next", {{"callback", NamedCallback{unended->logical_id}}})));
  }
  if (!group.type) {
    judgement.unseen(without_event(group.first_seen, note("group-announcement-unseen")));
  }
  if (group.callbacks.empty()) {
    judgement.unseen(without_event(group.first_seen, note("no-registration-in-group")));
  }
}

// Of each process the first callback that was never registered: it may belong to any group.
std::map<ProcessIndex, Evidence> unknown_members(const Model& model) {
  std::map<ProcessIndex, Evidence> unknown;
  for (const auto& callback : model.callbacks) {
    if (callback.registered || unknown.contains(callback.process)) continue;
    unknown.emplace(
        callback.process,
        without_event(first_sign(model, callback),
                      note("group-unknown", {{"callback", NamedCallback{callback.logical_id}}})));
  }
  return unknown;
}

std::vector<SubjectVerdict> judge_groups(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  const auto& isolated = context.isolated;
  // Groups whose thread is not known to be isolated or not; and processes in which it may be any.
  std::map<std::pair<ProcessIndex, GroupId>, Evidence> unknown;
  std::map<ProcessIndex, Evidence> unknown_of_process;
  for (const auto& [index, reason] : context.unknown_threads) {
    for (const auto* pair : model.threads[at(index)].ran) {
      const auto& callback = model.callbacks[at(pair->callback)];
      if (callback.group) {
        unknown.try_emplace({callback.process, *callback.group}, reason);
      } else if (!callback.registered && !is_ros2_only(model.processes[at(callback.process)])) {
        unknown_of_process.try_emplace(callback.process, reason);
      }
    }
  }
  const auto members = unknown_members(model);
  std::vector<SubjectVerdict> verdicts;
  std::set<std::pair<ProcessIndex, GroupId>> seen;
  std::set<ThreadIndex> judged;
  for (std::size_t i = 0; i < model.groups.size(); ++i) {
    const auto& group = model.groups[i];
    seen.insert({group.process, group.id});
    const auto threads = isolated.of(group);
    judged.insert(threads.begin(), threads.end());
    Judgement judgement(names.group(GroupIndex{static_cast<std::uint32_t>(i)}), context.known);
    if (!threads.empty()) {
      judge_group(context, group, threads, judgement);
      judgement.needs(context.known.unseen_registration(group.process));
      if (const auto member = members.find(group.process); member != members.end()) {
        judgement.unseen(member->second);
      }
    }
    if (const auto found = unknown.find({group.process, group.id}); found != unknown.end()) {
      judgement.unseen(found->second);
    }
    if (const auto found = unknown_of_process.find(group.process);
        found != unknown_of_process.end()) {
      judgement.unseen(found->second);
    }
    conclude(std::move(judgement), verdicts);
  }
  // There is a group, and no event names it.
  for (const auto& [process, reason] : unknown_of_process) {
    const auto is_its = [index = process](const GroupFacts& group) {
      return group.process == index;
    };
    if (std::ranges::any_of(model.groups, is_its)) continue;
    Judgement judgement(names.group(process, kNoGroup), context.known);
    judgement.unseen(reason);
    conclude(std::move(judgement), verdicts);
  }
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    const auto& thread = model.threads[i];
    if (!is_isolated(thread) || (!thread.group && judged.contains(index))) continue;
    if (thread.group && !seen.insert({thread.process, *thread.group}).second) continue;
    Judgement judgement(
        thread.group ? names.group(thread.process, *thread.group) : names.group_of(index),
        context.known);
    judgement.unseen(evidence("thread_init", *thread.announced,
                              note("group-of-isolated-thread-unseen", {{"tid", thread.tid}})));
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

// An announced thread ran nothing once it had ended.
void need_lasting_announcement(const RuleContext& context, ThreadIndex index,
                               Judgement& judgement) {
  const auto& known = context.known;
  const auto& thread = context.model.threads[at(index)];
  const bool has_ended_unseen =
      !thread.fini && context.model.processes[at(thread.process)].run_end.has_value();
  for (const auto* pair : thread.ran) {
    const auto last = pair->last_activity.time;
    judgement.needs_none(known.run_behind_end(*pair));
    // A callback that went on elsewhere may have left a thread that was replaced.
    const auto is_later = [last](const CallbackOnThread* other) {
      return other->last_activity.time > last;
    };
    if (!has_ended_unseen ||
        std::ranges::any_of(context.model.callbacks[at(pair->callback)].ran_on, is_later))
      continue;
    judgement.needs(
        {hidden(EventKind::thread_exit, known.scope_of(index), pair->first_start.time, last)});
  }
}

std::vector<Evidence> never_announced(const Model& model, const ThreadFacts& thread) {
  std::vector<Evidence> witnesses;
  if (thread.former_fini) {
    witnesses.push_back(
        evidence("thread_fini", *thread.former_fini, note("former-thread-ends-work")));
  }
  witnesses.push_back(
      evidence("callback_start", first_start_on(thread), note("callback-ran-here")));
  if (const auto known = scheduled_text(thread); !known.empty()) {
    witnesses.push_back(evidence("sched_switch", thread.scheduled.back().first.at,
                                 note("kernel-schedules-unannounced", {{"parameters", known}})));
  }
  if (const auto& end = model.processes[at(thread.process)].run_end) {
    witnesses.push_back(evidence("run_end", end->at,
                                 note("counts-announced-threads", {{"threads", end->threads}})));
  }
  return witnesses;
}

std::vector<SubjectVerdict> judge_known(const RuleContext& context) {
  const auto& model = context.model;
  const auto& known = context.known;
  auto verdicts = judge_threads(
      context, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        if (thread.ran.empty() && !is_isolated(thread)) return;
        // What was not seen to run may have run on a thread that was never announced.
        if (const auto lost = context.losses.of_every_run(index))
          judgement.needs(known.lost_end(*lost));
        if (thread.ran.empty()) return;
        for (const auto* pair : thread.ran)
          judgement.checked(pair->starts);
        judgement.needs(known.unseen_callback(thread.process));
        if (thread.announced) {
          need_lasting_announcement(context, index, judgement);
        } else {
          judgement.violation([&] { return never_announced(model, thread); },
                              {{hidden(EventKind::announcement, known.scope_of(index))}});
        }
      });
  note_missing_vtid(context, verdicts);
  note_runs_lost_whole(context, verdicts);
  return verdicts;
}

}  // namespace

const Rule kSingleCallbackGroup{
    .id = "M8",
    .name = "single-callback-group",
    .meaning = "The group of an isolated thread has one callback at a time, and is not reentrant.",
    .why_it_matters =
        "Callbacks of one group share its thread and so wait for each other, although each looks "
        "isolated in the configuration; a reentrant group needs several threads.",
    .inconclusive_when =
        "the group, the callbacks in it, or the threads of its process were never announced, or the "
        "callback_fini of one was not seen, nor that it lived when the next was registered.",
    .remedy =
        "create each callback with a callback group of its own, which is the default but in rclcpp, "
        "instead of handing several the same one.",
    .remedy_rclcpp =
        "create a callback group for each callback: those created without one share the node's.",
    .violation = "held several callbacks",
    .judge = judge_groups,
};

const Rule kThreadKnown{
    .id = "M9",
    .name = "thread-known",
    .meaning =
        "Every thread that ran a callback was announced by the executor, and runs none after its "
        "thread_fini unless it is announced anew (it may still publish).",
    .why_it_matters =
        "Of a thread that nobody announced nobody knows the role or applied parameters: its "
        "callbacks run by chance.",
    .inconclusive_when =
        "no announcement was seen, and there is no proof that nothing is missing or the thread was "
        "read back all the same, when a callback may have been lost with all of its instances, a "
        "start after a thread_fini or the thread_fini of a thread that was not replaced was lost, "
        "or the context vtid is absent.",
    .remedy =
        "run callbacks from the executor's threads only; call no callback from a thread of your "
        "own.",
    .violation = "ran callbacks unannounced",
    .judge = judge_known,
    .needs = {.instances = true}};

}  // namespace cie::analysis
