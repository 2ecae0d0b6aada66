#include "scheduled_parameters.hpp"

#include <cie/analysis/note.hpp>

#include "callback_doubts.hpp"
#include "parameter_words.hpp"
#include "spec_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// As the kernel counts (see ScheduledAs). SCHED_IDLE keeps a nice value that nobody asked for
// (proc(5): priority): this is without one.
std::int32_t kernel_priority(const ThreadParameters& asked) {
  return cie::kernel_priority(*asked.policy, asked.nice, asked.priority);
}

bool is_as_asked(const ScheduledAs& scheduled, const ThreadParameters& asked) {
  if (!asked.policy) return true;
  if (asked.policy == Policy::idle) return !is_real_time_priority(scheduled.first.prio);
  return scheduled.first.prio == kernel_priority(asked);
}

// Which policy it is. Threads that nobody configured are SCHED_OTHER, and have the same priority.
std::optional<Note> untold_policy(const ThreadParameters& asked) {
  if (asked.policy != Policy::batch && asked.policy != Policy::idle) return std::nullopt;
  return note("switches-tell-no-policy");
}

// What is asked for and sched_switch cannot tell.
std::optional<Note> untold(const ThreadParameters& asked) {
  if (auto policy = untold_policy(asked)) return policy;
  if (asked.policy == Policy::deadline) return note("switches-tell-no-deadline-parameters");
  if (asked.slice_ns) return note("switches-tell-no-time-slices");
  if (asked.util_min || asked.util_max) return note("switches-tell-no-utilization-clamps");
  return std::nullopt;
}

bool is_allowed(const SpecEntry& entry, const EventRef& where) {
  const auto& allowed = *entry.parameters.cpus;
  return !where.cpu ||
         std::ranges::find(allowed, static_cast<std::uint32_t>(*where.cpu)) != allowed.end();
}

Evidence ran_outside(const RuleContext& context, const SpecEntry& entry, const char* event,
                     const EventRef& where) {
  return evidence(event, where,
                  note("ran-outside-asked-cpus",
                       {{"asked", asks(context, entry)}, {"cpu", where.cpu.value_or(-1)}}));
}

// `entry` asks for CPUs. What a thread used before its first instance, it may have used before it was
// given its CPUs. Empty: it used no other ones.
std::optional<EventRef> switched_outside(const RuleContext& context, ThreadIndex index,
                                         const ScheduledAs& scheduled, const SpecEntry& entry,
                                         Judgement& judgement) {
  const auto since = first_start_on(context.model.threads[at(index)]).time;
  for (const auto& used : scheduled.cpus) {
    if (used.last.time < since || is_allowed(entry, used.last)) continue;
    // Switched in before its first instance, and again, or still there.
    const bool is_later = used.first.time < since && used.last.time > since;
    const auto& where = is_later ? used.last : used.first;
    if (const auto other = context.lives.may_be_another(index, where.time)) {
      judgement.unseen(other);
      continue;
    }
    return where;
  }
  return std::nullopt;
}

// Where a start or an end of its callbacks shows the thread on a CPU that `entry` does not ask for,
// from then on: whatever was recorded of its switches.
std::optional<EventRef> own_event_outside(const ThreadFacts& thread, const SpecEntry& entry,
                                          Timestamp since) {
  for (const auto* pair : thread.ran) {
    for (const auto& used : pair->cpus) {
      const bool is_there = used.first.cpu == pair->last_activity.cpu;
      const auto& last = is_there ? pair->last_activity : used.last;
      if (last.time < since || is_allowed(entry, last)) continue;
      return used.first.time >= since ? used.first : last;
    }
  }
  return std::nullopt;
}

// Nothing is known of how it was scheduled.
bool is_unseen(const ThreadFacts& thread, const EventRef& begin, Judgement& judgement) {
  if (!thread.scheduled.empty()) return false;
  const auto* const code = !thread.is_known_to_kernel ? "no-read-back-in-container"
                           : thread.switched_in       ? "no-read-back-nor-priority-of-its-own"
                                                      : "no-read-back-nor-switch";
  judgement.unseen(without_event(begin, note(code, {{"tid", thread.tid}})));
  return true;
}

// The kernel's record is not of all the time since the thread's first instance.
std::optional<Evidence> unrecorded(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  return context.kernel_record.outside(index, first_start_on(thread).time);
}

// It did not live before.
Timestamp earliest_birth(const RuleContext& context, const ThreadFacts& thread) {
  return thread.start_ns ? Timestamp{*thread.start_ns}
                         : latest_begin(context.model.processes[at(thread.process)]);
}

// A priority that the thread had from the first switch on may be inherited since before the kernel's record.
std::optional<Evidence> untold_before(const RuleContext& context, const ThreadFacts& thread,
                                      const ScheduledAs& raised) {
  if (&raised != &thread.scheduled.front()) return std::nullopt;
  const auto born = earliest_birth(context, thread);
  return context.holes.since(context.model.processes[at(thread.process)].host, born, born);
}

// What is missing, and what it may hide.
std::optional<Evidence> hiding(std::optional<Evidence> missing, std::string_view code) {
  if (missing) missing->note = note(code, {{"missing", std::move(missing->note)}});
  return missing;
}

// A priority above the one asked for may be inherited by an event that is lost, or never told.
std::vector<Evidence> perhaps_inherited(const RuleContext& context, ThreadIndex index,
                                        const ScheduledAs& raised) {
  constexpr std::string_view kInherited = "priority-perhaps-inherited-since";
  const auto& thread = context.model.threads[at(index)];
  return listed({hiding(context.kernel_record.loss(index), kInherited),
                 context.kernel_record.untold_inheritance(index, earliest_birth(context, thread),
                                                          raised.last.time),
                 hiding(untold_before(context, thread, raised), kInherited)});
}

using Stretches = std::vector<ScheduledAs>;

// From where a thread is meant to stay as it is scheduled: where the spec's priority was seen first;
// if it asks for none or that was not seen, what it had when its first instance began.
Stretches::const_iterator reference_of(const ThreadFacts& thread, const SpecEntry* entry) {
  const auto& all = thread.scheduled;
  if (entry != nullptr && entry->parameters.policy) {
    const auto match = std::ranges::find_if(
        all, [entry](const ScheduledAs& as) { return is_as_asked(as, entry->parameters); });
    if (match != all.end()) return match;
  }
  const auto start = first_start_on(thread).time;
  const auto after = std::ranges::find_if(
      all, [start](const ScheduledAs& as) { return as.first.at.time > start; });
  return after == all.begin() ? after : std::prev(after);
}

std::string cpus_text(Stretches::const_iterator from, Stretches::const_iterator to) {
  std::set<std::int32_t> cpus;
  for (; from != to; ++from) {
    for (const auto& on : from->cpus) {
      if (on.first.cpu) cpus.insert(*on.first.cpu);
    }
  }
  std::string text = cpus.size() == 1 ? "CPU " : "CPUs ";
  for (const auto cpu : cpus)
    text += (text.back() == ' ' ? "" : ",") + std::to_string(cpu);
  return text;
}

// S1: what was lost or not recorded from then on may be that the thread was configured anew.
std::vector<Evidence> perhaps_former(const RuleContext& context, ThreadIndex index,
                                     Timestamp since) {
  const auto host = context.model.processes[at(context.model.threads[at(index)].process)].host;
  const auto end = context.lives.of(index).latest_end();
  if (end <= since) return {};
  constexpr std::string_view kSince = "parameters-perhaps-changed-since";
  return listed({hiding(context.holes.between(host, since, end), kSince),
                 hiding(context.kernel_record.outside(index, since), kSince)});
}

// S1: of the last configuration, by switches, or else by its own events.
void judge_last_cpus(const RuleContext& context, ThreadIndex index, const SpecEntry& entry,
                     Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const auto& last = thread.scheduled.back();
  const auto accuse = [&](const char* event, const EventRef& where) {
    judgement.violation_unless(perhaps_former(context, index, where.time),
                               {ran_outside(context, entry, event, where)});
  };
  if (const auto switched = switched_outside(context, index, last, entry, judgement)) {
    accuse("sched_switch", *switched);
  } else if (const auto outside = own_event_outside(thread, entry, last.first.at.time)) {
    accuse("cpu", *outside);
  }
}

void judge_thread(const RuleContext& context, ThreadIndex index, const SpecEntry& entry,
                  Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const EventRef begin = moment(context.lives.of(index).begin, thread.tid);
  judgement.unseen(context.kernel_record.loss(index));
  judgement.unseen(unrecorded(context, index));
  if (is_unseen(thread, begin, judgement)) return;
  judgement.checked();
  const auto& last = thread.scheduled.back();
  if (const auto other = context.lives.may_be_another(index, last.first.at.time)) {
    judgement.unseen(other);
    return;
  }
  if (!is_as_asked(last, entry.parameters)) {
    auto unseen = perhaps_former(context, index, last.last.time);
    const bool is_raised = last.first.prio < kernel_priority(entry.parameters);
    if (is_raised)
      std::ranges::move(perhaps_inherited(context, index, last), std::back_inserter(unseen));
    judgement.violation_unless(
        unseen,
        {evidence("sched_switch", last.last,
                  note("scheduled-unlike-asked", {{"asked", asks(context, entry)},
                                                  {"tid", thread.tid},
                                                  {"priority", priority_text(last.first.prio)}}))});
  }
  if (entry.parameters.cpus) judge_last_cpus(context, index, entry, judgement);
  if (auto what = untold(entry.parameters)) {
    judgement.unseen(without_event(begin, *std::move(what)));
  }
  judgement.remark(evidence("sampled", begin, note("by-priority-and-cpus-of-switches")));
}

// S2: what may hide how the thread was scheduled when its first instance began.
std::optional<Evidence> lost_before(const RuleContext& context, ThreadIndex index,
                                    Timestamp start) {
  const auto& thread = context.model.threads[at(index)];
  const auto& seen = thread.scheduled.front().first.at;
  if (seen.time > start) {
    return evidence("sched_switch", seen, note("priority-before-unknown"));
  }
  const auto host = context.model.processes[at(thread.process)].host;
  const auto begin = std::min(seen.time, context.lives.of(index).begin);
  return context.holes.between(host, begin, start);
}

// S4: by its own events.
void judge_own_cpus(const RuleContext& context, const ThreadFacts& thread, const SpecEntry& entry,
                    Timestamp since, const std::vector<Evidence>& unseen, Judgement& judgement) {
  if (const auto outside = own_event_outside(thread, entry, since)) {
    judgement.violation_unless(unseen, {ran_outside(context, entry, "cpu", *outside)});
  }
}

// The thread may have been given the spec's priority, from which on its CPUs are judged, before `as`.
std::optional<Evidence> lost_beginning(const RuleContext& context, ThreadIndex index,
                                       const SpecEntry& entry, const ScheduledAs& as) {
  if (!entry.parameters.policy) return std::nullopt;
  const auto& thread = context.model.threads[at(index)];
  if (!is_as_asked(as, entry.parameters)) {
    const auto loss = context.kernel_record.loss(index);
    return loss ? loss : unrecorded(context, index);
  }
  const auto start = first_start_on(thread).time;
  const auto seen = as.first.at.time;
  const auto host = context.model.processes[at(thread.process)].host;
  return seen > start ? context.holes.since(host, start, seen) : std::nullopt;
}

}  // namespace

bool is_never_read_back(const CallbackFacts& callback) noexcept { return !callback.is_accounted; }

bool is_never_read_back(const Model& model, const ThreadFacts& thread) noexcept {
  return !thread.announced && thread.read_backs.count == 0 && !thread.fini && !thread.former_fini &&
         is_ros2_only(model.processes[at(thread.process)]);
}

const SpecEntry* sole_entry(const RuleContext& context, const ThreadFacts& thread) {
  if (thread.ran.size() != 1 || !thread.ran.front()->is_certain) return nullptr;
  return spec_entry(context, context.model.callbacks[at(thread.ran.front()->callback)]);
}

std::string scheduled_text(const ThreadFacts& thread) {
  const auto& all = thread.scheduled;
  if (all.empty()) return {};
  return priority_text(all.back().first.prio) + " on " + cpus_text(all.begin(), all.end());
}

void judge_scheduled_unchanged(const RuleContext& context, ThreadIndex index,
                               Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const EventRef begin = moment(context.lives.of(index).begin, thread.tid);
  judgement.unseen(context.proof.loss(index));
  judgement.unseen(context.kernel_record.loss(index));
  judgement.unseen(unrecorded(context, index));
  if (is_unseen(thread, begin, judgement)) return;
  const auto* entry = sole_entry(context, thread);
  const auto kept = reference_of(thread, entry);
  judgement.checked();
  const auto later = std::next(kept);
  const auto& judged = later == thread.scheduled.end() ? *kept : *later;
  auto unseen = listed({context.lives.may_be_another(index, judged.first.at.time)});
  judgement.unseen(unseen);
  if (later == thread.scheduled.end()) {
    judgement.remark(
        evidence("sampled", begin,
                 note("by-priority-of-switches", {{"priority", priority_text(kept->first.prio)}})));
    return;
  }
  // Another nice value under SCHED_IDLE is what was asked for, too.
  const bool is_asked = entry != nullptr && entry->parameters.policy &&
                        is_as_asked(*kept, entry->parameters) &&
                        !is_as_asked(*later, entry->parameters);
  const auto was =
      evidence("sched_switch", kept->last,
               note("scheduled-with",
                    {{"priority", priority_text(kept->first.prio)},
                     {"as_asked",
                      is_asked ? note("as-asked", {{"asked", asks(context, *entry)}}) : Note{}}}));
  const auto is =
      evidence("sched_switch", later->first.at,
               note("scheduled-from-here-with", {{"priority", priority_text(later->first.prio)}}));
  if (is_asked) {
    const bool is_raised = later->first.prio < kept->first.prio;
    if (is_raised)
      std::ranges::move(perhaps_inherited(context, index, *later), std::back_inserter(unseen));
    judgement.violation_unless(unseen, {was, is});
  } else {
    judgement.unseen(was);
    judgement.unseen(evidence("sched_switch", later->first.at,
                              note("scheduled-from-here-perhaps-meant",
                                   {{"priority", priority_text(later->first.prio)}})));
  }
}

void judge_scheduled_cpus(const RuleContext& context, ThreadIndex index, Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const EventRef begin = moment(context.lives.of(index).begin, thread.tid);
  const auto* entry = sole_entry(context, thread);
  const auto& all = thread.scheduled;
  judgement.unseen(context.proof.loss(index));
  judgement.unseen(unrecorded(context, index));
  const bool is_unseen_by_kernel = is_unseen(thread, begin, judgement);
  if (entry == nullptr || !entry->parameters.cpus) {
    if (is_unseen_by_kernel) return;
    judgement.unseen(without_event(begin, note("no-read-back-of-cpus-but-switches",
                                               {{"cpus", cpus_text(all.begin(), all.end())}})));
    return;
  }
  if (is_unseen_by_kernel) {
    if (!entry->parameters.policy) judge_own_cpus(context, thread, *entry, {}, {}, judgement);
    return;
  }
  judgement.checked();
  if (const auto lost = context.losses.on(index); lost && context.kernel_record.loss(index))
    judgement.needs(context.known.lost_end(*lost));
  judgement.remark(evidence(
      "sampled", begin,
      note(context.kernel_record.loss(index) ? "by-cpus-of-spec-with-holes" : "by-cpus-of-spec")));
  auto as = reference_of(thread, entry);
  const auto unseen = listed({lost_beginning(context, index, *entry, *as)});
  judgement.unseen(unseen);
  const bool is_given = entry->parameters.policy && is_as_asked(*as, entry->parameters);
  const auto since = is_given ? as->first.at.time : Timestamp{};
  bool is_outside = false;
  for (; as != all.end(); ++as) {
    const auto where = switched_outside(context, index, *as, *entry, judgement);
    if (where)
      judgement.violation_unless(unseen, {ran_outside(context, *entry, "sched_switch", *where)});
    is_outside = is_outside || where;
  }
  if (!is_outside) judge_own_cpus(context, thread, *entry, since, unseen, judgement);
}

void judge_scheduled(const RuleContext& context, const CallbackFacts& callback,
                     const SpecEntry& entry, Judgement& judgement) {
  for (const auto* pair : callback.ran_on) {
    if (auto other = perhaps_anothers(*pair)) {
      judgement.unseen(*std::move(other));
    } else {
      judge_thread(context, pair->thread, entry, judgement);
    }
  }
}

void judge_scheduled_before(const RuleContext& context, CallbackIndex index, const SpecEntry& entry,
                            Judgement& judgement) {
  const auto& model = context.model;
  const auto& proof = context.proof;
  const auto& callback = model.callbacks[at(index)];
  if (callback.ran_on.empty() || !entry.parameters.policy) return;
  judgement.unseen(proof.loss(index));                 // there may have been an earlier instance
  if (callback.starts.first.value_or(1) != 0) return;  // before the window
  const auto* const first = *std::ranges::min_element(
      callback.ran_on, {}, [](const CallbackOnThread* pair) { return pair->first_start.time; });
  if (auto other = perhaps_anothers(*first)) {
    judgement.unseen(*std::move(other));
    return;
  }
  const auto& scheduled = model.threads[at(first->thread)].scheduled;
  const auto match = std::ranges::find_if(
      scheduled, [&entry](const ScheduledAs& as) { return is_as_asked(as, entry.parameters); });
  if (match == scheduled.end()) {  // never: S1's concern
    if (!model.hosts[at(model.processes[at(callback.process)].host)].has_switches) return;
    judgement.unseen(context.kernel_record.loss(first->thread));
    judgement.unseen(unrecorded(context, first->thread));
    return;
  }
  if (const auto other = context.lives.may_be_another(first->thread, match->first.at.time)) {
    judgement.unseen(other);
    return;
  }
  const auto start = first->first_start.time;
  if (auto what = untold_policy(entry.parameters)) {
    judgement.unseen(evidence("sched_switch", match->first.at, *std::move(what)));
  }
  auto unseen = listed({context.user_losses.between(callback.process, Timestamp{}, start),
                        lost_before(context, first->thread, start)});
  judgement.unseen(unseen);
  if (match->first.at.time <= start) {
    judgement.checked();
    return;
  }
  const auto before = std::find_if(
      scheduled.begin(), match, [start](const ScheduledAs& as) { return as.last.time >= start; });
  if (before == match) {
    judgement.unseen(
        evidence("sched_switch", match->first.at, note("asked-priority-seen-only-here")));
    return;
  }
  judgement.checked();
  const bool is_raised = before->first.prio < match->first.prio;
  if (is_raised) {
    std::ranges::move(perhaps_inherited(context, first->thread, *before),
                      std::back_inserter(unseen));
  }
  judgement.violation_unless(
      unseen,
      {evidence("callback_start", first->first_start,
                note("started-unconfigured",
                     {{"callback", NamedCallback{callback.logical_id}},
                      {"instances", std::max<std::uint64_t>(match->starts_before, 1)}})),
       evidence("sched_switch", before->last,
                note("still-scheduled-with", {{"priority", priority_text(before->first.prio)}})),
       evidence(
           "sched_switch", match->first.at,
           note("only-now-scheduled-with", {{"priority", priority_text(match->first.prio)}}))});
}

}  // namespace cie::analysis
