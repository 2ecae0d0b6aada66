#include "scheduled_parameters.hpp"

#include "thread_questions.hpp"

#include <algorithm>
#include <string>

namespace cie::analysis {
namespace {

// As the kernel counts (see ScheduledAs): -1, 99 - priority, 120 + nice.
std::int32_t kernel_priority(const ThreadParameters& asked) {
  switch (*asked.policy) {
    case Policy::fifo:
    case Policy::round_robin:
      return 99 - static_cast<std::int32_t>(asked.priority);
    case Policy::deadline:
      return -1;
    case Policy::other:
    case Policy::batch:
      return 120 + asked.nice;
    case Policy::idle:
      break;
  }
  return 120;
}

bool is_as_asked(const ScheduledAs& scheduled, const ThreadParameters& asked) {
  return !asked.policy || scheduled.first.prio == kernel_priority(asked);
}

std::string asks(const RuleContext& context, const SpecEntry& entry) {
  return place(context, entry.line) + " asks for " + describe(entry.parameters);
}

// What is asked for and sched_switch cannot tell.
std::optional<std::string> untold(const ThreadParameters& asked) {
  if (asked.policy == Policy::deadline) return "runtime, deadline and period";
  if (asked.slice_ns) return "time slices";
  if (asked.util_min || asked.util_max) return "utilization clamps";
  return std::nullopt;
}

void judge_cpus(const RuleContext& context, const ScheduledAs& scheduled, const SpecEntry& entry,
                Judgement& judgement) {
  const auto& allowed = entry.parameters.cpus;
  if (!allowed) return;
  const auto outside = std::ranges::find_if(scheduled.cpus, [&allowed](const EventRef& on) {
    return on.cpu &&
           std::ranges::find(*allowed, static_cast<std::uint32_t>(*on.cpu)) == allowed->end();
  });
  if (outside == scheduled.cpus.end()) return;
  judgement.fail(
      evidence("sched_switch", *outside,
               asks(context, entry) + "; the thread ran on CPU " + std::to_string(*outside->cpu)));
}

void judge_thread(const RuleContext& context, ThreadIndex index, const SpecEntry& entry,
                  Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const EventRef begin = moment(context.lives.of(index).begin, thread.tid);
  judgement.doubt(context.proof.kernel_loss(index));
  if (thread.scheduled.empty()) {
    judgement.doubt(evidence("sched_switch", begin,
                             "thread " + std::to_string(thread.tid) +
                                 " has no read-back, and no switch of it was seen; record kernel "
                                 "events"));
    return;
  }
  judgement.check();
  const auto& last = thread.scheduled.back();
  if (!is_as_asked(last, entry.parameters)) {
    const bool is_raised = last.first.prio < kernel_priority(entry.parameters);
    if (is_raised) judgement.overrule(context.proof.kernel_loss(index));  // perhaps inherited
    judgement.fail(evidence("sched_switch", last.last,
                            asks(context, entry) + "; the kernel schedules thread " +
                                std::to_string(thread.tid) + " with " +
                                priority_text(last.first.prio)));
  }
  judge_cpus(context, last, entry, judgement);
  if (const auto what = untold(entry.parameters)) {
    judgement.doubt(evidence("thread_sched", begin, "sched_switch does not tell " + *what));
  }
  judgement.remark(evidence("sampled", begin,
                            "by the priority and the CPUs of its switches: FIFO and RR are one "
                            "there, and CPUs that it did not use are not seen"));
}

}  // namespace

bool is_never_read_back(const CallbackFacts& callback) noexcept { return !callback.is_accounted; }

void judge_scheduled(const RuleContext& context, const CallbackFacts& callback,
                     const SpecEntry& entry, Judgement& judgement) {
  for (const auto& pair : callback.ran_on)
    judge_thread(context, pair.thread, entry, judgement);
}

void judge_scheduled_before(const RuleContext& context, CallbackIndex index, const SpecEntry& entry,
                            Judgement& judgement) {
  const auto& model = context.model;
  const auto& callback = model.callbacks[at(index)];
  if (callback.ran_on.empty() || !entry.parameters.policy) return;
  const auto first = std::ranges::min_element(
      callback.ran_on, {}, [](const CallbackOnThread& pair) { return pair.first_start.time; });
  const auto& scheduled = model.threads[at(first->thread)].scheduled;
  const auto match = std::ranges::find_if(
      scheduled, [&entry](const ScheduledAs& as) { return is_as_asked(as, entry.parameters); });
  if (match == scheduled.end()) return;        // never: S1's concern
  judgement.doubt(context.proof.loss(index));  // there may have been an earlier instance
  const auto start = first->first_start.time;
  if (match->first.at.time <= start) {
    judgement.check();
    return;
  }
  const auto before = std::find_if(
      scheduled.begin(), match, [start](const ScheduledAs& as) { return as.last.time >= start; });
  if (before == match) {
    judgement.doubt(evidence("sched_switch", match->first.at,
                             "only here its priority was seen to be the one asked for; whether it "
                             "was before the first instance is unknown"));
    return;
  }
  judgement.check();
  judgement.fail(
      evidence("callback_start", first->first_start,
               callback.logical_id + " started unconfigured; " +
                   counted(std::max<std::uint64_t>(match->starts_before, 1), "instance") + " did"));
  judgement.fail(evidence("sched_switch", before->last,
                          "still scheduled with " + priority_text(before->first.prio)));
  judgement.fail(evidence("sched_switch", match->first.at,
                          "only now with " + priority_text(match->first.prio)));
}

}  // namespace cie::analysis
