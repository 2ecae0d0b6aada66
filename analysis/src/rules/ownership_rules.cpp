#include "ownership_rules.hpp"

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "scheduled_parameters.hpp"
#include "spec_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// The last one that came before, or else the first one.
const Announcement& in_force(const std::vector<Announcement>& all, Timestamp time) {
  const auto later =
      std::ranges::find_if(all, [time](const Announcement& one) { return one.at.time > time; });
  return later == all.begin() ? all.front() : *std::prev(later);
}

enum class Ownership : std::uint8_t { own, foreign, unknown };

// Whether the thread was announced for the callback whenever it ran it.
Ownership ownership_of(const std::vector<Announcement>& all, const ThreadFacts& thread,
                       const CallbackFacts& callback, const CallbackOnThread& pair) {
  const bool is_of_process = thread.process == callback.process;
  const auto is_own_at = [&](Timestamp time) {
    return is_of_process && std::ranges::any_of(all, [&](const Announcement& one) {
             return is_for(one, callback) && one.may_hold(time);
           });
  };
  if (!is_own_at(pair.first_start.time)) return Ownership::foreign;
  return is_own_at(pair.last_activity.time) ? Ownership::own : Ownership::unknown;
}

void judge_foreign_callbacks(const Model& model, const ThreadFacts& thread, Judgement& judgement) {
  const auto announcements = announcements_of(thread);
  if (thread.former.size() == kMostFormer) {
    judgement.doubt(
        evidence("thread_init", announcements.back().at,
                 "it was announced for too many callbacks to tell whose starts are its own"));
    return;
  }
  for (const auto* pair : thread.ran) {
    const auto& callback = model.callbacks[at(pair->callback)];
    judgement.check(pair->starts);
    auto ownership = ownership_of(announcements, thread, callback, *pair);
    if (ownership == Ownership::own && !pair->first_beside_other) continue;
    auto seq = pair->first_seq;
    auto start = pair->first_start;
    if (ownership != Ownership::foreign && pair->first_beside_other) {
      ownership = Ownership::foreign;
      std::tie(seq, start) = *pair->first_beside_other;
    }
    const auto& announced = in_force(announcements, start.time);
    if (ownership == Ownership::unknown) {
      judgement.doubt(without_event(pair->last_activity,
                                    "whether " + callback.logical_id +
                                        " started on it when it was announced for another callback "
                                        "is unknown"));
      continue;
    }
    if (!callback.registered && !announced.callback) continue;  // perhaps of its group
    judgement.fail([&] {
      return evidence("thread_init", announced.at,
                      "announced for callback " +
                          (announced.callback ? std::to_string(to_number(*announced.callback))
                                              : std::string("of its group")));
    });
    judgement.fail([&] {
      const bool is_start_seen = pair->starts != 0;
      return evidence(is_start_seen ? "callback_start" : "callback_end", start,
                      (is_start_seen ? "started " : "ended ") + callback.logical_id + " (seq " +
                          std::to_string(seq) + "), which is not its own");
    });
  }
}

// Why what it ran, which is not its own, may have run on a later thread with its tid. Where its own
// callback was not seen, its announcement tells that it was there.
std::optional<Evidence> perhaps_another(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  if (thread.ran.size() > 1) return context.lost_ends.between_callbacks(index);
  return context.lost_ends.between(index, thread.announced->time,
                                   thread.ran.front()->first_start.time);
}

// Of an isolated thread on which no callback was seen to run, and no total tells that none did: what it
// did may have been in callbacks.
std::optional<Evidence> perhaps_in_callbacks(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  if (!is_isolated(thread) || !thread.ran.empty()) return std::nullopt;
  const auto owner = context.isolated.idle_owner(index);
  if (owner && context.model.callbacks[at(*owner)].fini)
    return std::nullopt;  // of which nothing is lost
  return context.proof.incompleteness(thread.process);
}

// From when on a wait of the thread would have been its first one.
Timestamp work_begins(const RuleContext& context, const ThreadFacts& thread) {
  auto begin = *thread.first_wait;
  if (thread.announced) begin = std::min(begin, thread.announced->time);
  if (!thread.ran.empty()) begin = std::min(begin, thread.ran.front()->first_start.time);
  const auto& window = context.options.window;
  return window ? std::max(begin, std::min(window->from, *thread.first_wait)) : begin;
}

// Why the foreign work of a thread is not known of which the kernel's record is whole.
std::string why_unmeasured(const Model& model, const ThreadFacts& thread) {
  const auto host = model.processes[at(thread.process)].host;
  if (!model.hosts[at(host)].has_switches)
    return "no sched_switch events; record with --kernel to measure foreign work";
  if (!thread.first_wait && thread.is_known_to_kernel)
    return "it never waited once it was set up: there is no first wait to count foreign work from";
  return "on-CPU time outside callbacks is not known without gap";
}

void judge_foreign_time(const RuleContext& context, ThreadIndex index, const SpecEntry& entry,
                        Judgement& judgement) {
  const auto& model = context.model;
  const auto& proof = context.proof;
  const auto& thread = model.threads[at(index)];
  const EventRef end = moment(context.lives.of(index).latest_end(), thread.tid);
  const auto& lost = proof.loss(index) ? proof.loss(index) : context.losses.on(index);
  if (lost) {  // what lost instances did would count as foreign work; or its time is another one
    judgement.doubt(lost);
    return;
  }
  const bool is_unread = is_never_read_back(model, thread);
  if (thread.kernel_exit && !thread.fini && !is_unread) {
    judgement.doubt(evidence(std::string(thread.kernel_exit_event), *thread.kernel_exit,
                             "it exits, and the end of its work was not seen"));
    return;
  }
  const auto budget = *entry.foreign_work_budget_ns;
  const auto host = model.processes[at(thread.process)].host;
  // What was not recorded before the first wait that was seen may hide the first one.
  const auto loss = thread.first_wait
                        ? context.holes.since(host, work_begins(context, thread), end.time)
                        : context.kernel_record.loss(index);
  if (loss) {
    judgement.doubt(loss);
    return;
  }
  if (!thread.foreign_ns || !thread.foreign_span_ns || !thread.first_wait) {
    judgement.doubt(without_event(end, why_unmeasured(model, thread)));
    return;
  }
  if (*thread.foreign_span_ns == 0) return;  // it was over before the window
  judgement.check();
  if (is_unread) {
    judgement.remark(evidence("sampled", moment(*thread.first_wait, thread.tid),
                              "nobody announced whose thread it is: it ran one callback"));
  }
  // foreign / span > budget / second, in whole nanoseconds.
  const bool is_above = static_cast<Int128>(*thread.foreign_ns) * 1'000'000'000 >
                        static_cast<Int128>(budget) * *thread.foreign_span_ns;
  if (!is_above) return;
  judgement.overrule(perhaps_in_callbacks(context, index));
  judgement.fail(evidence("sched_switch", moment(*thread.first_wait, thread.tid),
                          "first wait: foreign work is counted from here"));
  // To where the work was counted no event need stand.
  const auto counted_to = *thread.first_wait + Duration{*thread.foreign_span_ns};
  judgement.fail(
      without_event(moment(counted_to, thread.tid),
                    nanoseconds(*thread.foreign_ns) + " on a CPU outside callbacks within " +
                        nanoseconds(*thread.foreign_span_ns) + "; " + place(context, entry.line) +
                        " allows " + nanoseconds(budget) + " per second"));
}

bool asks_for_budgets(const SchedulingSpec* spec) {
  const auto has_budget = [](const SpecEntry& entry) {
    return entry.foreign_work_budget_ns.has_value();
  };
  return spec != nullptr && (std::ranges::any_of(spec->callbacks(), has_budget) ||
                             std::ranges::any_of(spec->threads(), has_budget));
}

std::vector<SubjectVerdict> judge_foreign_work(const RuleContext& context) {
  const auto& unknown = context.unknown_threads;
  const bool has_budgets = asks_for_budgets(context.options.spec);
  auto verdicts = judge_threads(context, [&](ThreadIndex index, const ThreadFacts& thread,
                                             Judgement& judgement) {
    judgement.doubt(context.hidden.on(index));
    // It may be one that has a budget.
    if (has_budgets && !thread.announced) judgement.doubt(context.proof.loss(index));
    if (is_never_read_back(context.model, thread)) {
      const auto* entry = sole_entry(context, thread);
      if (entry != nullptr && entry->foreign_work_budget_ns) {
        judge_foreign_time(context, index, *entry, judgement);
        return;
      }
    }
    if (const auto found = unknown.find(index); found != unknown.end()) {
      judgement.doubt(found->second);
    }
    const bool is_worker = thread.announced && thread.role == ThreadRole::worker;
    if (is_isolated(thread)) {
      judge_foreign_callbacks(context.model, thread, judgement);
      if (judgement.has_witness()) judgement.overrule(perhaps_another(context, index));
      judgement.doubt(context.losses.on(index));
      if (!thread.ran.empty()) judgement.doubt(context.proof.unseen_callbacks(thread.process));
    }
    if (is_isolated(thread) || is_worker) {
      const auto* entry = spec_entry_of(context, index);
      if (entry == nullptr || !entry->foreign_work_budget_ns) return;
      if (thread.former.empty()) {
        judge_foreign_time(context, index, *entry, judgement);
      } else {
        judgement.doubt(evidence("thread_init", thread.former.back().next,
                                 "announced anew for another callback: in whose time it did the "
                                 "foreign work is unknown"));
      }
    }
  });
  note_missing_vtid(context.model, verdicts);
  return verdicts;
}

// Until when the callback lived, for all that is known: its end may be among what was lost since its last sign.
Timestamp known_end(const RuleContext& context, const CallbackFacts& callback) {
  if (callback.fini) return callback.fini->at.time;
  const auto last = last_sign(callback).time;
  return context.user_losses.between(callback.process, last, kLatest) ? last : kLatest;
}

// How many of the group's callbacks lived at the same time, at most: one that was made after another
// was destroyed takes its place.
std::size_t most_alive(const RuleContext& context, const std::vector<CallbackIndex>& callbacks) {
  const auto& model = context.model;
  std::multiset<Timestamp> ends;  // of those alive
  std::size_t most = 0;
  for (const auto index : callbacks) {  // as they were registered
    const auto& callback = model.callbacks[at(index)];
    ends.erase(ends.begin(), ends.upper_bound(callback.registered->time));
    ends.insert(known_end(context, callback));
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

void judge_group(const RuleContext& context, const GroupFacts& group,
                 const std::vector<ThreadIndex>& threads, Judgement& judgement) {
  const auto& model = context.model;
  auto callbacks = group.callbacks;
  std::erase_if(callbacks, [&](CallbackIndex index) {
    return context.is_after_window(model.callbacks[at(index)]);
  });
  judgement.check(callbacks.size());
  const auto witness = [&](const std::string& note) {
    judgement.fail(evidence("group_init", group.first_seen, note));
    for (const auto index : threads) {
      const auto& thread = model.threads[at(index)];
      judgement.fail([&thread] {
        return evidence("thread_init", *thread.announced,
                        "isolated thread " + std::to_string(thread.tid) + " serves it");
      });
    }
    for (const auto index : callbacks) {
      const auto& callback = model.callbacks[at(index)];
      judgement.fail([&callback] {
        return evidence("callback_init", *callback.registered,
                        callback.logical_id + " belongs to it");
      });
    }
  };
  if (group.type == GroupType::reentrant) witness("a reentrant group");
  if (const auto most = most_alive(context, callbacks); most >= 2) {
    witness("a group of " + std::to_string(most) + " callbacks");
  } else if (const auto* unended = unended_of_several(context, callbacks)) {
    judgement.doubt(evidence("callback_init", *unended->registered,
                             "whether " + unended->logical_id +
                                 " still lived when the next one was registered is unknown: its "
                                 "callback_fini was not seen"));
  }
  if (!group.type) {
    judgement.doubt(without_event(group.first_seen, "the group's announcement was not seen"));
  }
  if (group.callbacks.empty()) {
    judgement.doubt(
        without_event(group.first_seen, "no callback of the group was seen to be registered"));
  }
}

// Of each process the first callback that was never registered: it may belong to any group.
std::map<ProcessIndex, Evidence> unknown_members(const Model& model) {
  std::map<ProcessIndex, Evidence> unknown;
  for (const auto& callback : model.callbacks) {
    if (callback.registered || unknown.contains(callback.process)) continue;
    unknown.emplace(callback.process, without_event(first_sign(model, callback),
                                                    "the registration of " + callback.logical_id +
                                                        " was not seen: its group is unknown"));
  }
  return unknown;
}

std::vector<SubjectVerdict> judge_groups(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  const auto& proof = context.proof;
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
    Judgement judgement(names.group(GroupIndex{static_cast<std::uint32_t>(i)}));
    if (!threads.empty()) {
      judge_group(context, group, threads, judgement);
      judgement.doubt(proof.unseen_callbacks(group.process));
      if (const auto member = members.find(group.process); member != members.end()) {
        judgement.doubt(member->second);
      }
    }
    if (const auto found = unknown.find({group.process, group.id}); found != unknown.end()) {
      judgement.doubt(found->second);
    }
    if (const auto found = unknown_of_process.find(group.process);
        found != unknown_of_process.end()) {
      judgement.doubt(found->second);
    }
    conclude(std::move(judgement), verdicts);
  }
  // There is a group, and no event names it.
  for (const auto& [process, reason] : unknown_of_process) {
    const auto is_its = [index = process](const GroupFacts& group) {
      return group.process == index;
    };
    if (std::ranges::any_of(model.groups, is_its)) continue;
    Judgement judgement(names.group(process, kNoGroup));
    judgement.doubt(reason);
    conclude(std::move(judgement), verdicts);
  }
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    const auto& thread = model.threads[i];
    if (!is_isolated(thread) || (!thread.group && judged.contains(index))) continue;
    if (thread.group && !seen.insert({thread.process, *thread.group}).second) continue;
    Judgement judgement(thread.group ? names.group(thread.process, *thread.group)
                                     : names.group_of(index));
    judgement.doubt(evidence("thread_init", *thread.announced,
                             "no announcement of the group of isolated thread " +
                                 std::to_string(thread.tid) + " was seen"));
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

std::vector<SubjectVerdict> judge_known(const RuleContext& context) {
  const auto& model = context.model;
  const auto& proof = context.proof;
  auto verdicts = judge_threads(context, [&](ThreadIndex index, const ThreadFacts& thread,
                                             Judgement& judgement) {
    if (thread.ran.empty() && !is_isolated(thread)) return;
    // What was not seen to run may have run on a thread that was never announced.
    judgement.doubt(context.losses.of_every_run(index));
    if (thread.ran.empty()) return;
    for (const auto* pair : thread.ran)
      judgement.check(pair->starts);
    judgement.doubt(proof.unseen_callbacks(thread.process));
    if (thread.announced) {
      for (const auto* pair : thread.ran) {
        if (proof.loss(pair->callback)) judgement.doubt(end_after_fini(thread, *pair));
      }
      judgement.doubt(context.lost_ends.of(index));
      return;
    }
    if (const auto& why = proof.incompleteness(thread.process)) {
      judgement.overrule(why);
      if (const auto known = scheduled_text(thread); !known.empty()) {
        judgement.overrule(evidence("sched_switch", thread.scheduled.back().first.at,
                                    "the kernel schedules it with " + known +
                                        "; no event tells "
                                        "whose it is"));
      }
    }
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
  note_missing_vtid(context.model, verdicts);
  note_runs_lost_whole(context, verdicts);
  return verdicts;
}

}  // namespace

const Rule kNoForeignWork{
    .id = "M6",
    .name = "no-foreign-work",
    .meaning =
        "An isolated thread works for its own callback alone: it starts no other, and its work "
        "outside callbacks stays within foreign_work_budget (nanoseconds per second; without one "
        "it is not judged). Of a thread that is announced anew for another callback each start is "
        "judged by the announcement before it.",
    .why_it_matters =
        "Work that no callback accounts for delays the callback at its own priority, and no "
        "analysis of callbacks sees it.",
    .inconclusive_when =
        "a callback on it lost instances, another one may have been lost with all of its "
        "instances, the context vtid is absent, it may have served what ROS 2's events do not "
        "show (M2), or (for the budget) there are no kernel events, their record has a hole or "
        "begins after the thread, or read-backs or the end of the thread were lost, or no "
        "callback was seen on it and no total tells that none ran.",
    .remedy =
        "register the callback to the thread that runs it; move other work to a thread of its own "
        "(Executor::spawn_thread); record with --kernel.",
    .remedy_rclcpp =
        "let the thread spin for the callback's group alone; move other work to a thread of its "
        "own; record with --kernel.",
    .violation = "did other work",
    .judge = judge_foreign_work,
    .needs = {.instances = true, .later_state = LaterState::before_evidence}};

const Rule kSingleCallbackGroup{
    .id = "M8",
    .name = "single-callback-group",
    .meaning = "The group of an isolated thread has one callback at a time, and is not reentrant.",
    .why_it_matters =
        "Callbacks of one group share its thread and so wait for each other, although each looks "
        "isolated in the configuration; a reentrant group needs several threads.",
    .inconclusive_when =
        "the group, the callbacks in it, or the threads of its process were never announced, or the "
        "callback_fini of one before the next was registered may have been lost.",
    .remedy =
        "create each callback with a callback group of its own, which is the default but in rclcpp, "
        "instead of handing several the same one.",
    .remedy_rclcpp =
        "create a callback group for each callback: those created without one share the node's.",
    .violation = "held several callbacks",
    .judge = judge_groups,
    .needs = {.later_state = LaterState::before_evidence}};

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
        "no announcement was seen, and there is no proof that nothing is missing, when a callback "
        "may have been lost with all of its instances, a start after a thread_fini or the "
        "thread_fini of a thread that was not replaced was lost, or the context vtid is absent.",
    .remedy =
        "run callbacks from the executor's threads only; call no callback from a thread of your "
        "own.",
    .violation = "ran callbacks unannounced",
    .judge = judge_known,
    .needs = {.instances = true}};

}  // namespace cie::analysis
