#include <cie/analysis/schedulability.hpp>

#include "deadline_groups.hpp"
#include "excess.hpp"
#include "task_model.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

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
    const auto pinned = std::ranges::count_if(model_.tasks(), &Task::is_pinned);
    effort_ = kMaxEffort / std::max<std::ptrdiff_t>(pinned, 1);
    for (auto& task : model_.tasks()) {
      bound(task);
      explain_excess(model_, task);
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
          "SCHED_DEADLINE may give a later deadline; " +
          how_to_measure(*task.callback);
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
    if (result.bound_ns) {
      const auto seen =
          as_seen(task, {.execution = result.execution->ns, .period = result.period->ns});
      note_breaches(task, {});
      if (*seen.period > 0)
        task.bound_as_seen_ns = server_response_time(server, seen.execution, *seen.period);
      return;
    }
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
    auto found = model_.interference(processor, priority, task.lived(), &task);
    result.reason =
        found.unknown.empty() ? unknown_parameters(*task.thread()) : std::move(found.unknown);
    if (!result.reason.empty()) return;
    result.broken_declaration = std::move(found.broken_declaration);
    auto& rivals = found.rivals;
    rivals.push_back(
        {.execution = result.execution->ns, .period = result.period->ns, .priority = priority});
    result.bound_ns = worst_response_time(rivals, rivals.size() - 1, effort_);
    found.as_seen.push_back(as_seen(task, rivals.back()));
    note_breaches(task, std::move(found.breaches));
    if (!task.breaches.empty()) task.bound_as_seen_ns = bound_of_last(found.as_seen);
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

  static void note_breaches(Task& task, std::vector<Explanation> of_rivals) {
    for (const auto& own : breaches(task))
      task.breaches.push_back({.kind = own.kind, .text = own.subject + ' ' + own.what});
    std::ranges::move(of_rivals, std::back_inserter(task.breaches));
  }

  // Releases that coincide leave none.
  std::optional<std::int64_t> bound_of_last(const std::vector<FixedPriorityTask>& tasks) const {
    const bool coincide = std::ranges::any_of(
        tasks, [](const FixedPriorityTask& task) { return task.period && *task.period <= 0; });
    return coincide ? std::nullopt : worst_response_time(tasks, tasks.size() - 1, effort_);
  }

  // At some moment those at least as urgent demanded more than the CPU.
  bool is_overloaded(const Task& task, const Processor& processor) const {
    const auto moments =
        model_.at_moments(processor, static_cast<std::int32_t>(task.result.priority), task.lived());
    return std::ranges::any_of(moments, [](const Demand& demand) {
      return demand_exceeds_processor(demand.ppb, demand.rivals);
    });
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
      const auto all = model_.interference(processor, 1, {}, nullptr);
      const bool are_periods_known = std::ranges::all_of(
          all.rivals, [](const FixedPriorityTask& rival) { return rival.period.has_value(); });
      if (!all.unknown.empty() || !are_periods_known) {
        demand.reset();
        continue;
      }
      for (const auto& moment : model_.at_moments(processor, 1, {}))
        demand = std::max(*demand, moment.ppb);
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
  std::int64_t effort_ = 0;  // what the bound of one task may cost
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
