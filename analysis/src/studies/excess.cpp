#include "excess.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

std::int64_t max_of(const Rare<Summary>& summary) { return summary ? summary->max : 0; }

// Of the longest response; else of any instance.
std::int64_t known_or_longest(const std::optional<Duration>& known, const Rare<Summary>& of_any) {
  return known ? known->ns : max_of(of_any);
}

// Of an instance whose release is not known, which may be the longest one, they are not known.
const ResponseParts& parts_of_longest(const Task& task) {
  static const ResponseParts none;
  const bool is_exact = task.result.observed_ns == task.result.longest_ns();
  return is_exact ? task.callback->longest_response : none;
}

class Excess {
 public:
  // Requires that an instance was above the task's bound. Of explanations those by breaches come first.
  Excess(const TaskModel& model, Task& task) : model_(model), task_(task) {}

  void explain() {
    auto& result = task_.result;
    explain_by_breaches();
    explain_by_threads();
    explain_by_waiting();
    const auto excess = result.longest_ns() - *result.bound_ns;
    // Breaches together account for what they may add to the bound.
    auto explained = std::min(allowed_by_breaches(), excess);
    for (auto i = task_.breaches.size(); i < result.explanations.size(); ++i)
      explained += std::min(result.explanations[i].ns, excess);
    result.is_flagged = explained < excess;
    if (result.deadline && !result.meets_deadline()) result.reason = why_undecided();
  }

 private:
  void add(std::string kind, std::int64_t ns, std::string text) {
    if (ns > 0) task_.result.explanations.push_back({std::move(kind), std::move(text), ns});
  }

  // How much longer a response may be by declarations that were not kept.
  std::int64_t allowed_by_breaches() const {
    if (task_.breaches.empty()) return 0;
    return task_.bound_as_seen_ns ? *task_.bound_as_seen_ns - *task_.result.bound_ns
                                  : task_.result.longest_ns();
  }

  void explain_by_breaches() {
    const auto ns = allowed_by_breaches();
    if (ns <= 0) task_.breaches.clear();
    for (const auto& breach : task_.breaches)
      add(breach.kind, ns, breach.text);
  }

  // The threads of callbacks in bounds on the task's host that have the preemptor's tid.
  bool is_modelled(const Preemptor& preemptor) const {
    const auto is_it = [&](const ThreadReport* thread) {
      return thread != nullptr && thread->tid == preemptor.tid && thread->sched &&
             (is_fixed_priority(*thread->sched) || is_deadline(*thread->sched));
    };
    return std::ranges::any_of(model_.tasks(), [&](const Task& other) {
      return other.process->host_index == task_.process->host_index &&
             std::ranges::any_of(other.threads, is_it);
    });
  }

  // Threads that preempted it and are in no bound, and its CPU's idling.
  void explain_by_threads() {
    const auto longest =
        known_or_longest(parts_of_longest(task_).preempted, task_.callback->preempted);
    Int128 told = 0;
    for (const auto& preemptor : task_.callback->preempted_by) {
      told += preemptor.time.ns;
      if (is_modelled(preemptor) || preemptor.time.ns <= 0) continue;
      const auto time = in_us(preemptor.time.ns) + " in all its instances";
      const auto ns = std::min(preemptor.time.ns, longest);
      if (preemptor.is_idle()) {
        add("idle-cpu", ns,
            "it was runnable while its CPU was idle for " + time +
                ": it was throttled, or the CPU had not switched yet");
        continue;
      }
      add("outside-thread", ns,
          "thread " + std::to_string(preemptor.tid) + " (" + preemptor.name +
              "), which runs no callback of the model, ran in its place for " + time);
    }
    explain_by_unlisted(told, longest);
  }

  // Of threads that are too many to be listed nobody knows whether a bound counts them.
  void explain_by_unlisted(Int128 told, std::int64_t longest) {
    const auto& preempted = task_.callback->preempted;
    const auto listed = task_.callback->preempted_by.size();
    if (!preempted || listed == 0 || preempted->sum <= told) return;
    const auto rest = static_cast<std::int64_t>(preempted->sum - told);
    add("outside-thread", std::min(rest, longest),
        "threads beside the " + std::to_string(listed) + " that are listed ran in its place for " +
            in_us(rest) + " in all its instances");
  }

  // The bound less C is what other callbacks may demand from release to end, and what they did beyond
  // what was declared adds to that. Of the rest of the waiting, threads that ran outside their callbacks, and
  // the kernel, took each a part.
  void explain_by_waiting() {
    const auto& callback = *task_.callback;
    const auto& parts = parts_of_longest(task_);
    std::int64_t outside = 0;
    for (const auto& explanation : task_.result.explanations) {
      const bool is_outside =
          explanation.kind == "outside-thread" || explanation.kind == "idle-cpu";
      if (is_outside) outside += explanation.ns;
    }
    const auto preempted = known_or_longest(parts.preempted, callback.preempted);
    const auto by_model = std::max<std::int64_t>(preempted - outside, 0);
    explain_by_work_outside(by_model);
    explain_start(std::max<std::int64_t>(modelled() - by_model, 0));
    const auto wake_delay = known_or_longest(parts.wake_delay, callback.wake_delay);
    add("kernel", wake_delay,
        "when it had waited within the instance, it took " + in_us(wake_delay) +
            " from wake-up to running");
  }

  // What other callbacks may account for, with C and T as they were seen.
  std::int64_t modelled() const {
    const auto& result = task_.result;
    if (task_.breaches.empty()) return *result.bound_ns - result.execution->ns;
    if (!task_.bound_as_seen_ns) return std::numeric_limits<std::int64_t>::max();
    const auto own = as_seen(task_, {.execution = result.execution->ns, .period = std::nullopt});
    return *task_.bound_as_seen_ns - own.execution;
  }

  // `by_model`: for how long threads of the model preempted it.
  void explain_by_work_outside(std::int64_t by_model) {
    const auto& parts = parts_of_longest(task_);
    const auto measured =
        parts.preempted ? parts.preempted_outside : task_.callback->longest_preempted_outside;
    if (!measured) return;
    const auto outside = std::min(measured->ns, by_model);
    add("thread", std::min(by_model - modelled(), outside),
        "threads of the model preempted it for " + in_us(by_model) + ", and ran up to " +
            in_us(outside) + " of that outside their callbacks");
  }

  // `modelled`: what other callbacks may account for.
  void explain_start(std::int64_t modelled) {
    const auto& callback = *task_.callback;
    const auto& parts = parts_of_longest(task_);
    const auto& known = parts.start_latency;
    const auto start = known_or_longest(known, callback.start_latency);
    const auto late = start - modelled;
    const auto wakeup = max_of(callback.wakeup_latency);
    if (late > 0 && (known || late > wakeup)) {
      add("kernel", late,
          "an instance started " + in_us(start) + " after its release, " + in_us(late) +
              " more than the threads of the model account for: a timer, an interrupt, a "
              "wake-up or a thread in no bound took that long");
    } else if (!parts.preempted) {
      add("kernel", wakeup,
          "from wake-up to running took the kernel, or a thread in no bound, up to " +
              in_us(wakeup));
    }
  }

  std::string why_undecided() const {
    const auto& result = task_.result;
    if (result.is_flagged)
      return "an instance took longer than its bound, and nothing known explains all of that";
    if (!result.broken_declaration.empty()) {
      return "an instance took longer than its bound, which rests on a declaration that was not "
             "kept: " +
             result.broken_declaration;
    }
    return "an instance took longer than its bound, and with what explains that the bound is beyond "
           "the deadline";
  }

  const TaskModel& model_;
  Task& task_;
};

}  // namespace

void explain_excess(const TaskModel& model, Task& task) {
  if (task.result.is_above_bound()) Excess(model, task).explain();
}

}  // namespace cie::analysis
