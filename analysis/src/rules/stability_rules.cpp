#include "stability_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/tracepoints/policy.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "parameter_words.hpp"
#include "scheduled_parameters.hpp"
#include "spec_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// Announced, or read back or ended, which shows that an announcement was lost.
bool is_known(const ThreadFacts& thread) {
  return thread.announced || thread.read_backs.count != 0 || thread.fini;
}

// " (thread of CALLBACK)": who reads of a thread wants to know whose it is.
Note whose(const Model& model, const ThreadFacts& thread) {
  if (thread.ran.size() != 1) {
    return thread.name.empty() ? Note{} : note("thread-of-name", {{"name", thread.name}});
  }
  const auto& callback = model.callbacks[at(thread.ran.front()->callback)];
  return note("thread-of-callback", {{"callback", NamedCallback{callback.logical_id}}});
}

// The spec asks for a slice or a clamp that differs.
bool is_asked_for(const ThreadParameters& asked, const ReadBack& applied, const ReadBack& audit) {
  return (asked.slice_ns && applied.slice_ns != audit.slice_ns) ||
         (asked.util_min && applied.util_min != audit.util_min) ||
         (asked.util_max && applied.util_max != audit.util_max);
}

// What was applied and a later audit that differs from it. Null: none does.
const std::pair<ReadBack, ReadBack>* audit_mismatch(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  if (thread.audit_mismatch) return &*thread.audit_mismatch;
  const auto& mismatches = thread.slice_or_clamp_mismatches;
  const auto* entry = mismatches.empty() ? nullptr : spec_entry_of(context, index);
  if (entry == nullptr) return nullptr;
  const auto asked = std::ranges::find_if(mismatches, [entry](const auto& mismatch) {
    return is_asked_for(entry->parameters, mismatch.first, mismatch.second);
  });
  return asked != mismatches.end() ? &*asked : nullptr;
}

// The first one that the thread was compared with.
const ReadBack& first_reference(const ThreadFacts& thread) {
  return thread.applied.empty() ? *thread.first_audit : thread.applied.front();
}

// What the thread ran with last shows nothing of what was applied.
void judge_perhaps_inherited(const ThreadFacts& thread, Judgement& judgement) {
  if (!thread.perhaps_inherited) return;
  const auto& [at, prio] = *thread.perhaps_inherited;
  const auto inherited = note("perhaps-inherited-from-here", {{"priority", priority_text(prio)}});
  if (thread.audits_checked == 0) judgement.unseen(evidence("sched_switch", at, inherited));
  judgement.remark(evidence("by read-back", at, inherited));
}

// What differs from what was applied: unless other parameters may have been applied meanwhile; or before, where the
// first audit of an attached process stands for that.
void claim_mismatch(const RuleContext& context, ThreadIndex index, const ReadBack& applied,
                    const Evidence& later, Timestamp until, Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  judgement.violation(
      [&] {
        return std::vector{evidence("thread_sched", applied.at,
                                    note("applied", {{"parameters", describe(applied)},
                                                     {"whose", whose(context.model, thread)}})),
                           later};
      },
      context.known.other_parameters(index, applied, until));
}

void judge_unchanged(const RuleContext& context, ThreadIndex index, Judgement& judgement) {
  const auto& model = context.model;
  const auto& thread = model.threads[at(index)];
  judgement.checked(thread.audits_checked + thread.switches_checked);
  if (const auto* mismatch = audit_mismatch(context, index)) {
    const auto& [applied, audit] = *mismatch;
    claim_mismatch(context, index, applied,
                   evidence("thread_sched", audit.at,
                            note("later-read-back", {{"parameters", describe(audit)}})),
                   audit.at.time, judgement);
  }
  const auto host = model.processes[at(thread.process)].host;
  auto hole = context.kernel_record.loss(index);
  if (!hole) hole = context.kernel_record.outside(index, first_reference(thread).at.time);
  for (const auto* mismatch : {&thread.lowered_priority, &thread.raised_priority}) {
    if (!*mismatch) continue;
    const auto& [applied, priority] = **mismatch;
    auto gap = context.lives.may_be_another(index, priority.at.time);
    if (!gap && mismatch == &thread.raised_priority) {  // perhaps inherited, and that was lost
      gap = context.holes.since(host, applied.at.time, priority.at.time);
      if (!gap) {
        gap = context.kernel_record.untold_inheritance(index, context.lives.of(index).begin,
                                                       priority.at.time);
      }
      if (gap) {
        judgement.remark(
            evidence("by read-back", priority.at,
                     note("kernel-schedules-perhaps-inherited",
                          {{"priority", priority_text(priority.prio)}, {"why", gap->note}})));
      }
    }
    if (gap) {
      hole = gap;
      continue;
    }
    claim_mismatch(context, index, applied,
                   evidence("sched_switch", priority.at,
                            note("kernel-schedules", {{"priority", priority_text(priority.prio)}})),
                   kLatest, judgement);
  }
  judgement.needs_none(context.known.read_backs(index));
  judgement.unseen(unended_change(model, thread));
  judge_perhaps_inherited(thread, judgement);
  if (thread.audits_checked + thread.switches_checked == 0) {
    judgement.unseen(evidence(
        "thread_sched", thread.read_backs.last_at,
        note(model.hosts[at(host)].has_switches ? "no-later-audit-nor-switch" : "no-later-audit")));
  } else if (hole) {
    if (thread.audits_checked == 0) judgement.unseen(hole);
    judgement.remark(
        evidence("by read-back", thread.read_backs.last_at, note("switch-record-has-holes")));
  }
}

std::vector<SubjectVerdict> judge_parameters_unchanged(const RuleContext& context) {
  const auto& model = context.model;
  const auto& proof = context.proof;
  const auto& unknown = context.unknown_threads;
  return judge_threads(
      context, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        if (!is_known(thread) && thread.ran.empty()) return;
        if (context.is_before_window(index)) return;
        if (is_never_read_back(model, thread)) {
          judge_scheduled_unchanged(context, index, judgement);
          return;
        }
        if (const auto found = unknown.find(index); found != unknown.end()) {
          judgement.unseen(found->second);
        }
        if (last_applied(model, thread) != nullptr) {
          judge_unchanged(context, index, judgement);
        } else {
          judgement.needs_none(context.known.read_backs(index));
          const bool has_begin = model.processes[at(thread.process)].run_begin.has_value();
          if (thread.first_audit && !has_begin) {
            judgement.unseen(proof.incompleteness(thread.process));
          }
        }
      });
}

// No event of a thread that was read back could be held against the CPUs that it was allowed.
Evidence why_no_cpu_is_judged(const ThreadFacts& thread, const EventRef& begin) {
  const auto tells_cpu = [](const CallbackOnThread* pair) {
    return pair->first_start.cpu || pair->last_activity.cpu;
  };
  if (std::ranges::none_of(thread.ran, tells_cpu)) {
    return evidence("cpu_id", begin, note("events-without-cpu"));
  }
  return evidence("thread_sched", thread.last_read_back->at, note("no-mask-holds-for-events"));
}

// Lost starts and ends may show other CPUs.
void need_runs(const RuleContext& context, ThreadIndex index, Judgement& judgement) {
  if (const auto lost = context.losses.on(index)) judgement.needs(context.known.lost_end(*lost));
}

std::vector<SubjectVerdict> judge_allowed_cpus(const RuleContext& context) {
  const auto& model = context.model;
  return judge_threads(
      context, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        if (!is_known(thread) && thread.ran.empty()) return;
        if (is_never_read_back(model, thread)) {
          judge_scheduled_cpus(context, index, judgement);
          return;
        }
        judgement.checked(thread.cpus_checked);
        std::optional<Evidence> other;
        if (thread.cpu_violation) {
          other = context.lives.may_be_another(index, thread.cpu_violation->second.time);
        }
        if (thread.cpu_violation && !other) {
          const auto& [mask, where] = *thread.cpu_violation;
          judgement.violation(
              [&, &mask = mask, &where = where] {
                return std::vector{
                    evidence("thread_sched", mask.at,
                             note("last-read-back", {{"parameters", describe(mask)},
                                                     {"whose", whose(model, thread)}})),
                    evidence("cpu", where,
                             note("ran-outside-mask", {{"cpu", where.cpu.value_or(-1)}}))};
              },
              context.known.read_backs(index, mask.at.time));
        }
        judgement.needs_none(context.known.read_backs(index));
        judgement.unseen(unended_change(model, thread));
        const EventRef begin = moment(context.lives.of(index).begin, thread.tid);
        if (!thread.last_read_back) {
          judgement.unseen(without_event(begin, note("no-read-back-of-cpus")));
        } else if (thread.cpus_checked == 0 && !thread.ran.empty()) {
          judgement.unseen(why_no_cpu_is_judged(thread, begin));
        } else if (thread.switch_cpus_checked == 0) {
          need_runs(context, index, judgement);
          judgement.remark(evidence("sampled", begin, note("cpus-of-own-events-alone")));
        } else if (other || context.kernel_record.loss(index) ||
                   context.kernel_record.outside(index, begin.time)) {
          need_runs(context, index, judgement);
          judgement.remark(evidence("sampled", begin, note("switch-record-has-holes")));
        }
      });
}

bool is_ever_real_time(const ThreadFacts& thread) {
  const auto is = [](const Rare<ReadBack>& read_back) {
    return read_back && is_real_time(Policy{read_back->policy});
  };
  return is(thread.initial) || is(thread.first_audit) || is(thread.last_read_back) ||
         std::ranges::any_of(thread.applied, [](const ReadBack& read) {
           return is_real_time(Policy{read.policy});
         });
}

// Of a hole before it nobody knows what it hides: the child may have run, and been given its priority.
bool is_first_run_seen(const ForkFacts& fork, const KernelHoles& holes) {
  return fork.child_first && !holes.between(fork.host, fork.at.time, fork.child_first->at.time);
}

// What a first run does not tell: the child has another real-time priority than its creator's own,
// because it was given that before it ran (pthread_attr_setschedparam() does), or its creator changed
// its own since it was seen.
bool may_be_given(const ForkFacts& fork) {
  const auto prio = fork.child_first->prio;
  const bool may_be_own = prio == fork.parent_prio && !fork.is_parent_boosted;
  return is_real_time_priority(prio) && prio != fork.parent_own_prio && !may_be_own;
}

void judge_fork(const ForkFacts& fork, const KernelHoles& holes, Judgement& judgement) {
  if (!is_first_run_seen(fork, holes) || may_be_given(fork)) return;
  judgement.checked();
  if (!is_real_time_priority(fork.child_first->prio)) return;
  judgement.violation([&] {
    return std::vector{
        evidence("sched_process_fork", fork.at,
                 note("thread-creates-thread", {{"tid", fork.parent_tid},
                                                {"priority", priority_text(fork.parent_prio)},
                                                {"child", fork.child_tid}})),
        evidence("sched_switch", fork.child_first->at,
                 note("first-runs-with", {{"priority", priority_text(fork.child_first->prio)}}))};
  });
}

Evidence not_judged(const ForkFacts& fork) {
  return evidence(
      "sched_switch", fork.child_first->at,
      note("child-perhaps-given-priority",
           {{"child", fork.child_tid}, {"priority", priority_text(fork.child_first->prio)}}));
}

// What a thread began with, where that is among the read-backs that were lost.
std::optional<Evidence> lost_beginning(const Model& model, const Proof& proof, ThreadIndex index) {
  const auto& thread = model.threads[at(index)];
  const auto moment = model.processes[at(thread.process)].first_moment;
  if (thread.initial || moment == RunMoment::announce) return std::nullopt;
  return proof.loss(index);
}

// It was announced before the recording of its process began: what it reads back first in that is not
// what it began with.
bool has_begun_before(const ProcessFacts& process, const ThreadFacts& thread) {
  if (process.first_moment == RunMoment::start || !thread.start_ns) return false;
  const auto& first = process.run_begin ? process.run_begin : process.first_seen;
  return first && Timestamp{*thread.start_ns} < first->time;
}

void judge_beginning(const RuleContext& context, ThreadIndex index, const EventRef& begin,
                     Judgement& judgement) {
  const auto& [model, proof] = std::tie(context.model, context.proof);
  const auto& thread = model.threads[at(index)];
  const auto& process = model.processes[at(thread.process)];
  if (!thread.initial) {
    judgement.unseen(proof.gap(thread));  // its initial read-back may be what was lost
    judgement.unseen(lost_beginning(model, proof, index));
    return;
  }
  if (has_begun_before(process, thread)) {
    if (!process.run_begin) judgement.unseen(proof.incompleteness(thread.process));
    return;
  }
  judgement.checked();
  const auto earlier = context.known.read_backs(index, birth_of(thread).value_or(Timestamp{}),
                                                thread.initial->at.time);
  judgement.needs_none(earlier);
  if (!is_real_time(Policy{thread.initial->policy})) return;
  judgement.violation(
      [&] {
        return std::vector{
            evidence("thread_init", begin, note("thread-begins", {{"tid", thread.tid}})),
            evidence("thread_sched", thread.initial->at,
                     note("runs-before-applied", {{"parameters", describe(*thread.initial)}}))};
      },
      earlier);
}

// Some thread is real-time, or may have been before what is left of its record.
bool may_be_real_time(const Model& model, const Proof& proof) {
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    const auto& thread = model.threads[i];
    if (!is_known(thread)) continue;
    if (is_ever_real_time(thread) || lost_beginning(model, proof, index)) return true;
  }
  return false;
}

std::vector<SubjectVerdict> judge_no_leak(const RuleContext& context) {
  const auto& model = context.model;
  std::vector<SubjectVerdict> verdicts;
  const auto& names = context.names;
  const auto& proof = context.proof;
  if (!may_be_real_time(model, proof)) return verdicts;
  std::multimap<ThreadIndex, const ForkFacts*> of_thread;
  std::multimap<ThreadIndex, const ForkFacts*> given_by;
  for (const auto& fork : model.forks) {
    if (fork.child_tid == 0) continue;
    if (fork.parent && is_first_run_seen(fork, context.holes) && may_be_given(fork)) {
      given_by.emplace(*fork.parent, &fork);
    }
    if (fork.child && model.threads[at(*fork.child)].announced) {
      of_thread.emplace(*fork.child, &fork);
      continue;
    }
    // A child that never spoke: it has no process of ours to be named with.
    Judgement judgement(
        NamedSubject::without_row(SubjectKind::thread, std::to_string(fork.child_tid)),
        context.known);
    judge_fork(fork, context.holes, judgement);
    conclude(std::move(judgement), verdicts);
  }
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto& thread = model.threads[i];
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    if (!is_known(thread)) continue;
    Judgement judgement(names.thread(index), context.known);
    const auto& begin = thread.announced ? *thread.announced : thread.read_backs.first_at;
    if (!thread.announced) judgement.unseen(proof.loss(index));
    judge_beginning(context, index, begin, judgement);
    const auto [first, last] = of_thread.equal_range(index);
    for (auto fork = first; fork != last; ++fork)
      judge_fork(*fork->second, context.holes, judgement);
    const auto [given, last_given] = given_by.equal_range(index);
    for (auto fork = given; fork != last_given; ++fork)
      judgement.remark([&fork] { return not_judged(*fork->second); });
    const auto host = model.processes[at(thread.process)].host;
    if (!thread.is_known_to_kernel || !model.hosts[at(host)].has_forks) {
      judgement.remark(evidence("announced only", begin, note("no-fork-events")));
    } else if (context.kernel_record.loss(index)) {
      judgement.remark(evidence("announced only", begin, note("children-perhaps-in-holes")));
    }
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

}  // namespace

const Rule kParametersUnchanged{
    .id = "S3",
    .name = "parameters-unchanged",
    .meaning =
        "A thread keeps the parameters that were last applied: every later audit agrees with "
        "them, and so does the priority in every sched_switch, intervals of priority inheritance "
        "aside. On a process that was attached to, the first audit stands for what was applied. "
        "Where the kernel's record has holes, PASS says \"by read-back\"; where it does not "
        "declare sched_pi_setprio, a raised priority may be inherited and is not judged. Threads "
        "of ROS 2, which nobody reads back, are judged by the priorities of sched_switch from the "
        "spec's (without one, from the first instance) on: PASS says \"sampled\".",
    .why_it_matters =
        "Somebody outside (renice, chrt, taskset, a service manager) changed what the application "
        "had been given, and it goes on as if nothing had happened.",
    .inconclusive_when =
        "there is neither a later audit nor a whole record of the kernel's to compare with, a "
        "change of its parameters began that was not seen to end, "
        "read-backs, perhaps the first of an attached process, were lost, or may have been with "
        "what announced the thread for another spin.",
    .remedy =
        "find who changed it (the time of the evidence helps; so do the kernel's "
        "syscalls:sys_enter_sched_set* events) and stop it; on_change: apply_again has the "
        "executor put it right.",
    .remedy_rclcpp =
        "find who changed it (the time of the evidence helps; so do the kernel's "
        "syscalls:sys_enter_sched_set* events) and stop it.",
    .violation = "had parameters changed",
    .judge = judge_parameters_unchanged,
    .needs = {.kernel = true}};

const Rule kAllowedCpusOnly{
    .id = "S4",
    .name = "allowed-cpus-only",
    .meaning =
        "A thread ran only on CPUs of the mask that was last read back before; until its first "
        "parameters are applied, also of those that they give, and until it ends for the "
        "executor. Without kernel events only the CPUs of the thread's own events are known, and "
        "with holes in the kernel's record not all others: PASS then says \"sampled\". Threads of "
        "ROS 2, which nobody reads back, are judged by the spec's affinity: by their switches and "
        "by the CPUs of their starts and ends.",
    .why_it_matters =
        "A thread on a CPU that was kept for others disturbs them and loses its own cache.",
    .inconclusive_when =
        "there is no read-back of the mask, a change of its parameters began that was not seen to "
        "end, read-backs, perhaps the first of an attached process, "
        "were lost or may have been with what announced the thread for another spin, starts or "
        "ends on the thread were lost and its switches do not show all its CPUs, or the kernel "
        "recorded a part only of a thread that nobody reads back.",
    .remedy =
        "find who changed the mask after it was applied (taskset, a cpuset); give the spec's "
        "affinity and read it back.",
    .violation = "ran on forbidden CPUs",
    .judge = judge_allowed_cpus,
    .needs = {.kernel = true}};

const Rule kNoParameterLeak{
    .id = "S5",
    .name = "no-parameter-leak",
    .meaning =
        "No thread inherited a real-time policy that it was not given: announced threads are "
        "judged by what they read back when they were announced first, other children of "
        "real-time threads by the priority they first run with. One that first runs with another "
        "real-time priority than its creator's was given that, or its creator's changed "
        "meanwhile: it is not judged, and the creator's PASS says so. Without fork events, or "
        "where the kernel's record has holes, PASS says \"announced only\".",
    .why_it_matters =
        "A helper thread that inherits SCHED_FIFO by accident competes with the callbacks it was "
        "meant to stay away from.",
    .inconclusive_when =
        "the thread's first read-back was lost, or may have been with an earlier announcement of "
        "it.",
    .remedy =
        "SCHED_FLAG_RESET_ON_FORK for real-time threads, or create threads before raising the "
        "priority.",
    .violation = "inherited parameters",
    .judge = judge_no_leak,
    .needs = {.kernel = true}};

}  // namespace cie::analysis
