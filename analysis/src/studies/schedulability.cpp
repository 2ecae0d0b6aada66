#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/response_time_analysis.hpp>
#include <cie/analysis/schedulability.hpp>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::int64_t kAdmissiblePpb = 950'000'000;  // sched_rt_runtime_us / sched_rt_period_us

bool is_fixed_priority(const ThreadSchedReport& sched) {
  return sched.policy == static_cast<std::int32_t>(Policy::fifo) ||
         sched.policy == static_cast<std::int32_t>(Policy::round_robin);
}

bool is_deadline(const ThreadSchedReport& sched) {
  return sched.policy == static_cast<std::int32_t>(Policy::deadline);
}

DeadlineServer server_of(const ThreadSchedReport& sched) {
  return {.runtime = static_cast<std::int64_t>(sched.runtime_ns),
          .deadline = static_cast<std::int64_t>(sched.deadline_ns),
          .period = static_cast<std::int64_t>(sched.period_ns)};
}

std::int64_t max_of(const std::optional<Summary>& summary) { return summary ? summary->max : 0; }

std::string in_us(std::int64_t ns) {
  return std::to_string(ns / 1000) + '.' + std::to_string(ns % 1000 / 100) + " us";
}

// One callback with the thread that it runs on.
struct Task {
  const CallbackReport* callback = nullptr;
  const ThreadReport* thread = nullptr;  // null: not one, or its parameters are unknown
  HostIndex host{};                      // CPUs are of it: those of others share only their numbers
  CallbackSchedulability result;

  const ThreadSchedReport* sched() const {
    return thread != nullptr && thread->sched ? &*thread->sched : nullptr;
  }
  bool may_use(HostIndex of_host, std::uint32_t cpu) const {
    const auto* parameters = sched();
    return parameters != nullptr && host == of_host &&
           std::ranges::find(parameters->cpus, cpu) != parameters->cpus.end();
  }
  bool is_pinned() const { return sched() != nullptr && sched()->cpus.size() == 1; }
};

std::optional<TaskParameter> declared(const std::optional<std::int64_t>& value) {
  if (!value) return std::nullopt;
  return TaskParameter{.ns = *value, .source = ParameterSource::declared};
}

// Execution and waiting within the callback together ("suspension-oblivious": time in which it
// waits counts as execution, which is safe for it and for those below it; Chen et al., "Many
// Suspensions, Many Problems", Real-Time Systems 55, 2019).
// What is declared is execution time alone, as rule R4 judges it.
std::optional<TaskParameter> execution_of(const CallbackReport& callback, const SpecEntry* entry) {
  const auto waiting = max_of(callback.blocked);
  if (entry != nullptr && entry->wcet_ns) {
    return TaskParameter{.ns = *entry->wcet_ns + waiting, .source = ParameterSource::declared};
  }
  if (!callback.execution_time) return std::nullopt;
  return TaskParameter{.ns = callback.execution_time->max + waiting};
}

std::optional<TaskParameter> period_of(const CallbackReport& callback, const SpecEntry* entry) {
  if (entry != nullptr && entry->min_inter_arrival_ns) return declared(entry->min_inter_arrival_ns);
  if (callback.period_ns) return declared(static_cast<std::int64_t>(*callback.period_ns));
  if (!callback.inter_arrival) return std::nullopt;
  return TaskParameter{.ns = callback.inter_arrival->min};
}

std::optional<TaskParameter> deadline_of(const CallbackReport& callback, const SpecEntry* entry) {
  if (entry != nullptr && entry->response_deadline_ns) return declared(entry->response_deadline_ns);
  if (!callback.deadline_ns) return std::nullopt;
  return declared(static_cast<std::int64_t>(*callback.deadline_ns));
}

class Analysis {
 public:
  Analysis(const Report& report, const SchedulingSpec* spec) : report_(report), rows_(report) {
    for (const auto& callback : report.callbacks)
      tasks_.push_back(task_of(callback, spec));
  }

  SchedulabilityReport run() {
    SchedulabilityReport result;
    for (const auto& [host, name] : hosts_of_deadlines()) {
      result.deadline.push_back(admission(host));
      result.deadline.back().host = shown(name);
      if (result.deadline.back().is_guaranteed) edf_guaranteed_.insert(host);
    }
    result.outside = outside();
    for (auto& task : tasks_) {
      bound(task);
      compare(task);
      result.callbacks.push_back(task.result);
    }
    result.cpus = demands();
    return result;
  }

 private:
  Task task_of(const CallbackReport& callback, const SchedulingSpec* spec) {
    const auto* entry =
        spec != nullptr ? spec->find_callback(callback.logical_id, callback.period_ns.value_or(0))
                        : nullptr;
    Task task;
    task.callback = &callback;
    task.host = rows_.process_of(callback).host_index;
    task.result.index = callback.index;
    task.result.process = callback.process;
    task.result.logical_id = callback.logical_id;
    task.result.execution = execution_of(callback, entry);
    task.result.period = period_of(callback, entry);
    task.result.deadline = deadline_of(callback, entry);
    if (task.result.execution && callback.blocked) task.result.waiting_ns = callback.blocked->max;
    if (callback.response_time) task.result.observed_ns = callback.response_time->max;
    for (const auto* response : {&callback.response_time, &callback.response_time_lower}) {
      auto& least = task.result.observed_at_least_ns;
      if (*response) least = std::max(least.value_or((*response)->max), (*response)->max);
    }
    if (callback.threads.size() != 1) return task;
    task.result.tid = callback.threads.front().tid;
    task.thread = rows_.find(callback.threads.front().thread);
    if (const auto* sched = task.sched()) {
      task.result.policy = sched->policy_name;
      task.result.priority = sched->priority;
      task.result.cpus = sched->cpus;
    }
    return task;
  }

  // Why there is no bound for it at all; empty if one can be sought.
  std::string obstacle(const Task& task) const {
    const auto& callback = *task.callback;
    const auto* sched = task.sched();
    if (callback.threads.empty()) return "it never ran";
    if (callback.threads.size() > 1) return "it ran on several threads";
    if (sched == nullptr) return "the parameters of its thread are not in the recording";
    if (task.thread->callbacks.size() > 1) {
      return "its thread runs " + std::to_string(task.thread->callbacks.size()) +
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
      return "it was released once, so its inter-arrival time is not known; record longer, or "
             "declare min_inter_arrival in the spec";
    }
    if (task.result.period->ns <= 0) return "releases coincide: their least distance is 0";
    if (is_fixed_priority(*sched) && !task.is_pinned()) {
      return "it may run on " + std::to_string(sched->cpus.size()) +
             " CPUs; the theory is of one: pin it (affinity in the spec)";
    }
    return {};
  }

  void bound(Task& task) {
    auto& result = task.result;
    result.reason = obstacle(task);
    if (!result.reason.empty()) return;
    if (is_deadline(*task.sched())) {
      bound_server(task);
    } else {
      bound_fixed_priority(task);
    }
  }

  void bound_server(Task& task) {
    auto& result = task.result;
    result.method = BoundMethod::deadline_server;
    if (!edf_guaranteed_.contains(task.host)) {
      result.reason =
          "the EDF tests do not show that the SCHED_DEADLINE threads meet their deadlines";
      return;
    }
    result.bound_ns =
        server_response_time(server_of(*task.sched()), result.execution->ns, result.period->ns);
    if (!result.bound_ns) {
      result.reason = "its runtime per period is below what its releases demand";
    }
  }

  void bound_fixed_priority(Task& task) {
    auto& result = task.result;
    result.method = BoundMethod::fixed_priority;
    const auto cpu = task.sched()->cpus.front();
    std::vector<FixedPriorityTask> rivals{{.execution = result.execution->ns,
                                           .period = result.period->ns,
                                           .priority = priority_of(*task.sched())}};
    for (const auto& other : tasks_) {
      if (&other == &task || !other.may_use(task.host, cpu)) continue;
      const auto rival = demand_of(other);
      if (!rival || rival->priority < rivals.front().priority) continue;
      if (rival->execution < 0) {
        result.method = BoundMethod::none;
        result.reason = "the execution time of " + other.result.logical_id +
                        ", which may preempt it, is not known";
        return;
      }
      rivals.push_back(*rival);
    }
    result.bound_ns = worst_response_time(rivals, 0);
    if (!result.bound_ns) {
      result.reason = "the callbacks of CPU " + std::to_string(cpu) +
                      " that are at least as urgent demand more than all of it";
    }
  }

  static std::int32_t priority_of(const ThreadSchedReport& sched) {
    constexpr std::int32_t kAboveAll = 100;  // SCHED_DEADLINE preempts every other policy
    return is_deadline(sched) ? kAboveAll : static_cast<std::int32_t>(sched.priority);
  }

  // What another callback may demand of a CPU that it may use: all of it, wherever it ran. Empty
  // for policies that never preempt a real-time one; an execution of -1: unknown.
  static std::optional<FixedPriorityTask> demand_of(const Task& task) {
    const auto& sched = *task.sched();
    if (is_deadline(sched)) {
      // Two budgets may follow each other directly: the end of one period and the begin of the
      // next.
      return FixedPriorityTask{.execution = static_cast<std::int64_t>(sched.runtime_ns),
                               .period = static_cast<std::int64_t>(sched.period_ns),
                               .priority = priority_of(sched),
                               .jitter = static_cast<std::int64_t>(sched.deadline_ns) -
                                         static_cast<std::int64_t>(sched.runtime_ns)};
    }
    if (!is_fixed_priority(sched)) return std::nullopt;
    const auto& parameters = task.result;
    FixedPriorityTask rival{.execution = parameters.execution ? parameters.execution->ns : -1,
                            .period = std::nullopt,
                            .priority = priority_of(sched)};
    if (parameters.period) rival.period = parameters.period->ns;
    return rival;
  }

  void compare(Task& task) {
    auto& result = task.result;
    if (!result.is_above_bound()) return;
    const auto& callback = *task.callback;
    const auto add = [&result](std::string kind, std::int64_t ns, std::string text) {
      if (ns > 0) result.explanations.push_back({std::move(kind), std::move(text), ns});
    };
    const auto measured = max_of(callback.execution_time);
    if (result.execution->source == ParameterSource::declared) {
      const auto wcet = result.execution->ns - result.waiting_ns.value_or(0);
      add("overrun", measured - wcet,
          "an instance executed " + in_us(measured) + ", declared are " + in_us(wcet));
    }
    if (result.period->source == ParameterSource::declared && callback.inter_arrival &&
        callback.inter_arrival->min < result.period->ns) {
      add("burst", *result.observed_ns,
          "releases came " + in_us(callback.inter_arrival->min) + " apart, declared are " +
              in_us(result.period->ns));
    }
    explain_by_threads(task);
    // Of the time from release to start the model's threads account for the bound less C.
    const auto start = max_of(callback.start_latency);
    const auto late = start - (*result.bound_ns - result.execution->ns);
    if (late > max_of(callback.wakeup_latency)) {
      add("kernel", late,
          "an instance started " + in_us(start) + " after its release, " + in_us(late) +
              " more than the threads of the model account for: a timer, an interrupt or a wake-up "
              "took the kernel that long");
    } else {
      add("kernel", max_of(callback.wakeup_latency),
          "from wake-up to running took the kernel up to " +
              in_us(max_of(callback.wakeup_latency)));
    }
    const auto excess = *result.observed_ns - *result.bound_ns;
    std::int64_t explained = 0;
    for (const auto& explanation : result.explanations)
      explained += std::min(explanation.ns, excess);
    result.is_flagged = explained < excess;
  }

  // Threads that preempted it and are in no bound.
  void explain_by_threads(Task& task) const {
    const auto longest = max_of(task.callback->preempted);
    for (const auto& preemptor : task.callback->preempted_by) {
      const bool is_modelled = std::ranges::any_of(tasks_, [&](const Task& other) {
        return other.host == task.host && other.result.tid == preemptor.tid &&
               other.sched() != nullptr &&
               (is_fixed_priority(*other.sched()) || is_deadline(*other.sched()));
      });
      if (is_modelled || preemptor.time.ns <= 0) continue;
      const auto name = preemptor.tid == 0 ? std::string("the idle thread")
                                           : "thread " + std::to_string(preemptor.tid) + " (" +
                                                 preemptor.name + ')';
      task.result.explanations.push_back(
          {"outside-thread",
           name + ", which runs no callback of the model, ran in its place for " +
               in_us(preemptor.time.ns) + " in all its instances",
           std::min(preemptor.time.ns, longest)});
    }
  }

  // A host's name where it is needed to tell rows apart.
  std::string shown(const std::string& host) const {
    return report_.trace.hosts.size() > 1 ? host : std::string();
  }

  std::map<HostIndex, std::string> hosts_of_deadlines() const {
    std::map<HostIndex, std::string> hosts;
    for (const auto& thread : report_.threads) {
      if (!thread.sched || !is_deadline(*thread.sched)) continue;
      const auto& process = rows_.process_of(thread);
      hosts.emplace(process.host_index, process.host);
    }
    return hosts;
  }

  DeadlineAdmission admission(HostIndex host) const {
    std::vector<DeadlineServer> servers;
    std::set<std::uint32_t> cpus;
    for (const auto& thread : report_.threads) {
      if (!thread.sched || !is_deadline(*thread.sched)) continue;
      if (rows_.process_of(thread).host_index != host) continue;
      servers.push_back(server_of(*thread.sched));
      cpus.insert(thread.sched->cpus.begin(), thread.sched->cpus.end());
    }
    const auto processors = static_cast<std::uint32_t>(std::max<std::size_t>(cpus.size(), 1));
    const bool is_sound = std::ranges::all_of(
        servers, [](const DeadlineServer& server) { return server.period > 0; });
    return DeadlineAdmission{
        .servers = servers.size(),
        .processors = processors,
        .reserved_ppb = is_sound ? std::optional(reserved_ppb(servers)) : std::nullopt,
        .admissible_ppb = kAdmissiblePpb * static_cast<std::int64_t>(processors),
        .is_guaranteed = is_sound && are_deadlines_guaranteed(servers, processors)};
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
      if (const auto host = shown(rows_.process_of(thread).host); !host.empty())
        name += " on " + host;
      names.push_back(std::move(name));
    }
    return names;
  }

  std::vector<CpuDemand> demands() const {
    std::map<std::pair<HostIndex, std::uint32_t>, std::string> pinned;  // by host and CPU
    for (const auto& task : tasks_) {
      if (task.is_pinned() && is_fixed_priority(*task.sched())) {
        pinned.emplace(std::pair(task.host, task.sched()->cpus.front()),
                       shown(rows_.process_of(*task.callback).host));
      }
    }
    std::vector<CpuDemand> demands;
    for (const auto& [place, name] : pinned) {
      const auto [host, cpu] = place;
      CpuDemand demand{.host = name, .cpu = cpu, .real_time_ppb = 0};
      for (const auto& task : tasks_) {
        if (!task.may_use(host, cpu)) continue;
        const auto rival = demand_of(task);
        if (!rival) continue;
        if (rival->execution < 0 || rival->period.value_or(0) <= 0) {
          demand.real_time_ppb.reset();
          break;
        }
        *demand.real_time_ppb += static_cast<std::int64_t>(static_cast<Int128>(rival->execution) *
                                                           kWholeProcessorPpb / *rival->period);
      }
      demands.push_back(demand);
    }
    return demands;
  }

  const Report& report_;
  ReportRows rows_;
  std::vector<Task> tasks_;
  std::set<HostIndex> edf_guaranteed_;
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
