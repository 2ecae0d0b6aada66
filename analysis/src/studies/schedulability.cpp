#include <cie/analysis/schedulability.hpp>

#include "deadline_groups.hpp"
#include "task_model.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

std::int64_t max_of(const std::optional<Summary>& summary) { return summary ? summary->max : 0; }

class Analysis {
 public:
  Analysis(const Report& report, const SchedulingSpec* spec)
      : report_(report), model_(report, spec) {}

  SchedulabilityReport run() {
    SchedulabilityReport result;
    for (const auto& group : deadline_groups(report_, model_.rows())) {
      result.deadline.push_back(group.admission);
      for (const auto& [thread, is_guaranteed] : group.threads)
        servers_[thread] = {.is_guaranteed = is_guaranteed, .unknown = group.admission.unknown};
    }
    result.outside = outside();
    for (auto& task : model_.tasks()) {
      bound(task);
      compare(task);
      result.callbacks.push_back(task.result);
    }
    result.cpus = demands();
    return result;
  }

 private:
  // Why there is no bound for it at all; empty if one can be sought.
  std::string obstacle(const Task& task) const {
    const auto& callback = *task.callback;
    const auto* sched = task.sched();
    if (callback.threads.empty() && known_runs(callback) > 0) {
      return std::string("none of its instances is in the ") +
             (asked_window(report_.trace) ? "window" : "recording");
    }
    if (callback.threads.empty()) return "it never ran";
    if (callback.threads.size() > 1) return "it ran on several threads";
    if (sched == nullptr) return "the parameters of its thread are not in the recording";
    if (!task.thread()->former.empty()) return "the parameters of its thread changed";
    if (task.thread()->callbacks.size() > 1) {
      return "its thread runs " + std::to_string(task.thread()->callbacks.size()) +
             " callbacks, which wait for each other whatever their priorities";
    }
    if (!is_fixed_priority(*sched) && !is_deadline(*sched)) {
      return sched->policy_name + " gives no guarantee: when it runs depends on every other thread";
    }
    if (sched->policy == static_cast<std::int32_t>(Policy::round_robin)) {
      return "SCHED_RR takes turns, which this analysis does not bound; SCHED_FIFO has no turns";
    }
    if (!task.result.execution) {
      return "its execution time is not known; record with --kernel, or declare wcet in the spec";
    }
    if (!task.result.period) {
      return known_runs(callback) > 1
                 ? "its releases are not known, and so neither is its inter-arrival time; declare "
                   "min_inter_arrival in the spec"
                 : "it was released once, so its inter-arrival time is not known; record longer, or "
                   "declare min_inter_arrival in the spec";
    }
    if (const auto longer = longer_execution(task); !longer.empty()) {
      return "its longest execution time is not known, because " + longer +
             "; declare wcet in the spec";
    }
    if (const auto unmeasured = unmeasured_waiting(task); !unmeasured.empty()) {
      return "how long it waits within an instance is not known, because " + unmeasured;
    }
    if (const auto nearer = nearer_releases(task); !nearer.empty()) {
      return "its shortest inter-arrival time is not known, because " + nearer +
             "; declare min_inter_arrival in the spec";
    }
    if (task.result.period->ns <= 0) return "releases coincide: their least distance is 0";
    if (waits_for_another_thread(task)) {
      return "callbacks of its group run on other threads, and it waits for them whatever the "
             "priorities";
    }
    if (sched->cpus.empty()) return "the CPUs that its thread may use are not known";
    if (is_fixed_priority(*sched) && !task.is_pinned()) {
      return "it may run on " + std::to_string(sched->cpus.size()) +
             " CPUs; the theory is of one: pin it (affinity in the spec)";
    }
    return {};
  }

  // A callback group that runs no two at a time has another one, which ran elsewhere.
  bool waits_for_another_thread(const Task& task) const {
    const auto& callback = *task.callback;
    return callback.shares_group && std::ranges::any_of(model_.tasks(), [&](const Task& other) {
             return other.callback->shares_group && other.process == task.process &&
                    other.callback->group == callback.group &&
                    std::ranges::any_of(other.threads, [&task](const ThreadReport* thread) {
                      return thread != task.thread();
                    });
           });
  }

  void bound(Task& task) const {
    auto& result = task.result;
    result.reason = obstacle(task);
    if (!result.reason.empty()) return;
    if (is_deadline(*task.sched())) {
      bound_server(task);
    } else {
      bound_fixed_priority(task);
    }
    if (auto own = broken_declaration(task); !own.empty())
      result.broken_declaration = std::move(own);
    if (result.deadline && result.reason.empty() && !result.meets_deadline()) {
      result.reason =
          "its bound rests on a declaration that was not kept: " + result.broken_declaration;
    }
  }

  // The theory of servers is of jobs that do not wait: one that does may find its deadline
  // postponed, or its budget cut, by the rule for wake-ups (sched-deadline.rst of Linux).
  void bound_server(Task& task) const {
    auto& result = task.result;
    if (result.waiting_ns.value_or(0) > 0) {
      result.reason =
          "it waits within an instance: when it wakes up, SCHED_DEADLINE may give it a later "
          "deadline, which this analysis does not bound";
      return;
    }
    if (task.callback->longest_unmeasured) {
      result.reason =
          "whether it waits within an instance is not known of all of them, and what waits "
          "SCHED_DEADLINE may give a later deadline; record with --kernel";
      return;
    }
    const auto& known = servers_.at(task.thread());
    if (!known.unknown.empty()) {
      result.reason = known.unknown + ": it may have demanded more of its CPUs";
      return;
    }
    const auto server = server_of(*task.sched());
    result.method = BoundMethod::deadline_server;
    if (!known.is_guaranteed) {
      result.reason =
          "the EDF tests do not show that the SCHED_DEADLINE threads meet their deadlines";
      return;
    }
    result.bound_ns = server_response_time(server, result.execution->ns, result.period->ns);
    if (result.bound_ns) return;
    const bool is_overloaded = static_cast<Int128>(result.execution->ns) * server.period >
                               static_cast<Int128>(server.runtime) * result.period->ns;
    if (is_overloaded) {
      result.reason = "its runtime per period is below what its releases demand";
    } else {
      result.method = BoundMethod::none;
      result.reason =
          "its releases may come before its runtime is renewed: what then waits is not "
          "bounded here; give it a shorter period";
    }
  }

  void bound_fixed_priority(Task& task) const {
    auto& result = task.result;
    const auto processor = task.processor();
    const auto priority = static_cast<std::int32_t>(task.sched()->priority);
    auto [rivals, unknown, broken] = model_.interference(processor, priority, task.lived(), &task);
    result.reason = unknown.empty() ? unknown_parameters(*task.thread()) : std::move(unknown);
    if (!result.reason.empty()) return;
    result.broken_declaration = std::move(broken);
    rivals.push_back(
        {.execution = result.execution->ns, .period = result.period->ns, .priority = priority});
    result.bound_ns = worst_response_time(rivals, rivals.size() - 1);
    const auto cpu = "CPU " + std::to_string(processor.cpu);
    if (result.bound_ns || is_overloaded(task, processor)) {
      result.method = BoundMethod::fixed_priority;
      if (!result.bound_ns) {
        result.reason =
            "the callbacks of " + cpu + " that are at least as urgent demand more than all of it";
      }
    } else if (demand_exceeds_processor(rivals)) {
      result.reason = "the callbacks of " + cpu +
                      " that are at least as urgent demand more than all of it together, though no "
                      "two of some lived at once";
    } else {
      result.reason = "the callbacks of " + cpu +
                      " that are at least as urgent may keep it busy for too long to compute";
    }
  }

  // At some moment those at least as urgent demanded more than the CPU.
  bool is_overloaded(const Task& task, const Processor& processor) const {
    const auto own = FixedPriorityTask{.execution = task.result.execution->ns,
                                       .period = task.result.period->ns,
                                       .priority = static_cast<std::int32_t>(task.result.priority)};
    auto moments = model_.at_moments(processor, own.priority, task.lived(), &task);
    return std::ranges::any_of(moments, [&own](Interference& moment) {
      moment.rivals.push_back(own);
      return demand_exceeds_processor(moment.rivals);
    });
  }

  void compare(Task& task) const {
    auto& result = task.result;
    if (!result.is_above_bound()) return;
    const auto& callback = *task.callback;
    if (const auto what = overrun(task); !what.empty()) {
      const auto wcet = result.execution->ns - result.waiting_ns.value_or(0);
      explain(task, "overrun", callback.execution_time->max - wcet, "an instance " + what);
    }
    if (const auto what = burst(task); !what.empty())
      explain(task, "burst", result.longest_ns(), "releases " + what);
    explain_by_threads(task);
    explain_by_waiting(task);
    const auto excess = result.longest_ns() - *result.bound_ns;
    std::int64_t explained = 0;
    for (const auto& explanation : result.explanations)
      explained += std::min(explanation.ns, excess);
    result.is_flagged = explained < excess;
    if (result.deadline && !result.meets_deadline()) result.reason = why_undecided(result);
  }

  // Requires a bound that an instance was above.
  static std::string why_undecided(const CallbackSchedulability& callback) {
    if (callback.is_flagged)
      return "an instance took longer than its bound, and nothing known explains all of that";
    if (!callback.broken_declaration.empty())
      return "an instance took longer than its bound, which rests on a declaration that was not kept";
    return "an instance took longer than its bound, and with what explains that the bound is beyond "
           "the deadline";
  }

  bool is_modelled(const Task& task, const Preemptor& preemptor) const {
    return !modelled(task, preemptor).empty();
  }

  // The threads of callbacks in bounds on the task's host that have the preemptor's tid.
  std::vector<const ThreadReport*> modelled(const Task& task, const Preemptor& preemptor) const {
    std::vector<const ThreadReport*> found;
    for (const auto& other : model_.tasks()) {
      if (other.process->host_index != task.process->host_index) continue;
      std::ranges::copy_if(
          other.threads, std::back_inserter(found), [&](const ThreadReport* thread) {
            return thread != nullptr && thread->tid == preemptor.tid && thread->sched &&
                   (is_fixed_priority(*thread->sched) || is_deadline(*thread->sched)) &&
                   std::ranges::find(found, thread) == found.end();
          });
    }
    return found;
  }

  // Threads that preempted it and are in no bound.
  void explain_by_threads(Task& task) const {
    const auto longest =
        known_or_longest(parts_of_longest(task).preempted, task.callback->preempted);
    Int128 told = 0;
    for (const auto& preemptor : task.callback->preempted_by) {
      told += preemptor.time.ns;
      if (is_modelled(task, preemptor) || preemptor.time.ns <= 0) continue;
      const auto name = preemptor.tid == 0 ? std::string("the idle thread")
                                           : "thread " + std::to_string(preemptor.tid) + " (" +
                                                 preemptor.name + ')';
      explain(task, "outside-thread", std::min(preemptor.time.ns, longest),
              name + ", which runs no callback of the model, ran in its place for " +
                  in_us(preemptor.time.ns) + " in all its instances");
    }
    explain_by_unlisted(task, told, longest);
  }

  // Of threads that are too many to be listed nobody knows whether a bound counts them.
  static void explain_by_unlisted(Task& task, Int128 told, std::int64_t longest) {
    const auto& preempted = task.callback->preempted;
    const auto listed = task.callback->preempted_by.size();
    if (!preempted || listed == 0 || preempted->sum <= told) return;
    const auto rest = static_cast<std::int64_t>(preempted->sum - told);
    explain(task, "outside-thread", std::min(rest, longest),
            "threads beside the " + std::to_string(listed) +
                " that are listed ran in its place for " + in_us(rest) + " in all its instances");
  }

  // The bound less C is what other callbacks may demand from release to end; of the rest of the
  // waiting, threads that ran outside their callbacks, and the kernel, took each a part.
  void explain_by_waiting(Task& task) const {
    const auto& callback = *task.callback;
    const auto& parts = parts_of_longest(task);
    const auto modelled = *task.result.bound_ns - task.result.execution->ns;
    std::int64_t outside = 0;
    for (const auto& explanation : task.result.explanations) {
      if (explanation.kind == "outside-thread") outside += explanation.ns;
    }
    const auto preempted = known_or_longest(parts.preempted, callback.preempted);
    const auto by_model = std::max<std::int64_t>(preempted - outside, 0);
    explain(task, "thread", std::min(by_model - modelled, outside_callbacks(task)),
            "threads of the model preempted it for " + in_us(by_model) + ", their callbacks for " +
                in_us(modelled) + " of that at most: the rest they ran outside their callbacks");
    explain_start(task, std::max<std::int64_t>(modelled - by_model, 0));
    const auto wake_delay = known_or_longest(parts.wake_delay, callback.wake_delay);
    explain(task, "kernel", wake_delay,
            "when it had waited within the instance, it took " + in_us(wake_delay) +
                " from wake-up to running");
  }

  // `modelled`: what other callbacks may account for.
  static void explain_start(Task& task, std::int64_t modelled) {
    const auto& callback = *task.callback;
    const auto& parts = parts_of_longest(task);
    const auto& known = parts.start_latency;
    const auto start = known_or_longest(known, callback.start_latency);
    const auto late = start - modelled;
    const auto wakeup = max_of(callback.wakeup_latency);
    if (late > 0 && (known || late > wakeup)) {
      explain(task, "kernel", late,
              "an instance started " + in_us(start) + " after its release, " + in_us(late) +
                  " more than the threads of the model account for: a timer, an interrupt, a "
                  "wake-up or a thread in no bound took that long");
    } else if (!parts.preempted) {
      explain(task, "kernel", wakeup,
              "from wake-up to running took the kernel, or a thread in no bound, up to " +
                  in_us(wakeup));
    }
  }

  // How long those that preempted it ran without running a callback, as far as is known.
  std::int64_t outside_callbacks(const Task& task) const {
    constexpr auto kAny = std::numeric_limits<std::int64_t>::max();
    std::int64_t sum = 0;
    for (const auto& preemptor : task.callback->preempted_by) {
      for (const auto* thread : modelled(task, preemptor)) {
        if (!thread->busy_ns) return kAny;
        sum += std::max<std::int64_t>(*thread->busy_ns - executed_on(*thread), 0);
      }
    }
    return sum;
  }

  // As far as measured, of callbacks that ran nowhere else.
  std::int64_t executed_on(const ThreadReport& thread) const {
    Int128 sum = 0;
    for (const auto& task : model_.tasks()) {
      if (task.thread() == &thread && task.callback->execution_time)
        sum += task.callback->execution_time->sum;
    }
    return static_cast<std::int64_t>(std::min<Int128>(sum, thread.busy_ns.value_or(0)));
  }

  // Of an instance whose release is not known, which may be the longest one, they are not known.
  static const ResponseParts& parts_of_longest(const Task& task) {
    static const ResponseParts none;
    const bool is_exact = task.result.observed_ns == task.result.longest_ns();
    return is_exact ? task.callback->longest_response : none;
  }

  // Of the longest response; else of any instance.
  static std::int64_t known_or_longest(const std::optional<Duration>& known,
                                       const std::optional<Summary>& of_any) {
    return known ? known->ns : max_of(of_any);
  }

  static void explain(Task& task, std::string kind, std::int64_t ns, std::string text) {
    if (ns > 0) task.result.explanations.push_back({std::move(kind), std::move(text), ns});
  }

  std::vector<std::string> outside() const {
    std::vector<std::string> names;
    for (const auto& thread : report_.threads) {
      if (!thread.sched || !thread.callbacks.empty()) continue;
      if (!is_fixed_priority(*thread.sched) && !is_deadline(*thread.sched)) continue;
      auto name = "thread " + std::to_string(thread.tid) + " \"" + thread.name + "\" (" +
                  thread.sched->policy_name;
      if (is_fixed_priority(*thread.sched)) name += ' ' + std::to_string(thread.sched->priority);
      name += ')';
      if (const auto host = shown(model_.rows().process_of(thread)); !host.empty())
        name += " on " + host;
      names.push_back(std::move(name));
    }
    return names;
  }

  // Of CPUs that a callback of fixed priority is pinned to.
  std::vector<CpuDemand> demands() const {
    std::map<Processor, std::string> hosts;
    for (const auto& task : model_.tasks()) {
      if (task.is_pinned()) hosts.emplace(task.processor(), shown(*task.process));
    }
    std::vector<CpuDemand> demands;
    for (const auto& [processor, host] : hosts) {
      auto& demand =
          demands.emplace_back(CpuDemand{.host = host, .cpu = processor.cpu, .real_time_ppb = 0})
              .real_time_ppb;
      for (const auto& all : model_.at_moments(processor, 1, {}, nullptr)) {
        const bool are_periods_known = std::ranges::all_of(
            all.rivals, [](const FixedPriorityTask& rival) { return rival.period.has_value(); });
        if (!all.unknown.empty() || !are_periods_known) demand.reset();
        if (demand) demand = std::max(*demand, demanded_ppb(all.rivals));
      }
    }
    return demands;
  }

  // A host's name where it is needed to tell rows apart.
  std::string shown(const ProcessReport& process) const {
    return report_.trace.hosts.size() > 1 ? process.host : std::string();
  }

  const Report& report_;
  TaskModel model_;
  // Of a SCHED_DEADLINE thread and those that it shares CPUs with.
  struct Server {
    bool is_guaranteed = false;
    std::string unknown{};
  };
  std::map<const ThreadReport*, Server> servers_;
};

}  // namespace

std::string_view label(ParameterSource source) noexcept {
  return source == ParameterSource::declared ? "declared" : "measured";
}

std::string_view label(BoundMethod method) noexcept {
  switch (method) {
    case BoundMethod::none:
      return "none";
    case BoundMethod::fixed_priority:
      return "fixed_priority";
    case BoundMethod::deadline_server:
      return "deadline_server";
  }
  return {};
}

bool SchedulabilityReport::has_finding() const noexcept {
  return std::ranges::any_of(callbacks, [](const CallbackSchedulability& callback) {
    return callback.is_flagged || callback.meets_deadline() == false;
  });
}

std::size_t SchedulabilityReport::deadlines() const noexcept {
  return static_cast<std::size_t>(std::ranges::count_if(
      callbacks,
      [](const CallbackSchedulability& callback) { return callback.deadline.has_value(); }));
}

std::size_t SchedulabilityReport::decided_deadlines() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(callbacks, [](const CallbackSchedulability& callback) {
        return callback.meets_deadline().has_value();
      }));
}

std::string SchedulabilityReport::why_undecided() const {
  bool is_execution_unknown = true;
  std::set<std::string_view> reasons;
  for (const auto& callback : callbacks) {
    if (!callback.deadline) continue;
    is_execution_unknown = is_execution_unknown && !callback.execution;
    reasons.insert(callback.reason);
  }
  if (is_execution_unknown) return "execution times unknown";
  return reasons.size() == 1 ? std::string(*reasons.begin()) : "why is said of each";
}

SchedulabilityReport schedulability_of(const Report& report, const SchedulingSpec* spec) {
  return Analysis(report, spec).run();
}

}  // namespace cie::analysis
