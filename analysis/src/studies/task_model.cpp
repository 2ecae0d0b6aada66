#include "task_model.hpp"

#include <cie/analysis/deadline.hpp>
#include <cie/tracepoints/policy.hpp>

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::int32_t kAboveAll = 100;  // SCHED_DEADLINE preempts every other policy

std::optional<TaskParameter> declared(const std::optional<std::int64_t>& value) {
  if (!value) return std::nullopt;
  return TaskParameter{.ns = *value, .source = ParameterSource::declared};
}

std::int64_t with_waiting(const CallbackReport& callback, std::int64_t execution) {
  const auto waiting = callback.blocked ? callback.blocked->max : 0;
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  return execution > kMost - waiting ? kMost : execution + waiting;
}

// Execution and waiting within the callback together ("suspension-oblivious": time in which it
// waits counts as execution, which is safe for it and for those below it; Chen et al., "Many
// Suspensions, Many Problems", Real-Time Systems 55, 2019).
// What is declared is execution time alone, as rule R4 judges it.
std::optional<TaskParameter> execution_of(const CallbackReport& callback, const SpecEntry* entry) {
  if (entry != nullptr && entry->wcet_ns) {
    return TaskParameter{.ns = with_waiting(callback, *entry->wcet_ns),
                         .source = ParameterSource::declared};
  }
  if (!callback.execution_time) return std::nullopt;
  return TaskParameter{.ns = with_waiting(callback, callback.execution_time->max)};
}

// With that of a run in progress.
std::optional<Duration> shortest_arrival(const CallbackReport& callback) {
  auto shortest = callback.shortest_inter_arrival;
  if (callback.inter_arrival) {
    const Duration of_ended{callback.inter_arrival->min};
    shortest = std::min(shortest.value_or(of_ended), of_ended);
  }
  return shortest;
}

std::optional<TaskParameter> period_of(const CallbackReport& callback, const SpecEntry* entry) {
  if (entry != nullptr && entry->min_inter_arrival_ns) return declared(entry->min_inter_arrival_ns);
  if (callback.period_ns) return declared(signed_ns(*callback.period_ns));
  const auto shortest = shortest_arrival(callback);
  if (!shortest) return std::nullopt;
  return TaskParameter{.ns = shortest->ns};
}

std::optional<TaskParameter> deadline_of(const CallbackReport& callback, const SpecEntry* entry) {
  const auto deadline = response_deadline(entry, callback.deadline_ns.value_or(0));
  return deadline ? declared(deadline->ns) : std::nullopt;
}

bool is_declared(const std::optional<TaskParameter>& parameter) {
  return parameter && parameter->source == ParameterSource::declared;
}

// It was seen up to the end of the recording: one at most can be so of a callback that runs no two
// at a time.
bool is_one_in_progress(const CallbackReport& callback) {
  return callback.incomplete == 1 && callback.longest_open.has_value();
}

constexpr const char* kLacksRuns = "instances of it are missing from the recording";

// Runs of which nobody knows how long they executed or waited; empty: none.
std::string unknown_runs(const Task& task) {
  const auto& callback = *task.callback;
  if (callback.may_lack_runs) return kLacksRuns;
  if (const auto outside = callback.outside_window.value_or(0); outside > 0) {
    return std::to_string(outside) + " of its instances lie outside of what all streams cover";
  }
  const bool is_open_within = is_one_in_progress(callback) &&
                              callback.longest_open->until_end.ns <= task.result.execution->ns;
  if (callback.incomplete == 0 || is_open_within) return {};
  return std::to_string(callback.incomplete) + " of its instances did not end in the recording";
}

bool may_use(const std::vector<std::uint32_t>& cpus, std::uint32_t cpu) {
  return cpus.empty() || std::ranges::find(cpus, cpu) != cpus.end();  // none told: any
}

template <typename Visit>
void for_each_known(const ThreadReport& thread, const Visit& visit) {
  if (thread.sched) visit(*thread.sched);
  for (const auto& former : thread.former)
    visit(former);
}

// The highest fixed priority that a thread is known to have had where it may have used the CPU; 0:
// none.
std::int32_t priority_on(const ThreadReport& thread, std::uint32_t cpu) {
  std::int32_t highest = 0;
  for_each_known(thread, [&](const ThreadSchedReport& known) {
    if (is_fixed_priority(known) && may_use(known.cpus, cpu))
      highest = std::max(highest, static_cast<std::int32_t>(known.priority));
  });
  return highest;
}

// Two budgets may follow each other directly: the end of one period and the begin of the next.
FixedPriorityTask demand_of(const DeadlineServer& server) {
  return {.execution = server.runtime,
          .period = server.period,
          .priority = kAboveAll,
          .jitter = server.deadline - server.runtime};
}

// The kernel enforces it.
void add_server_demand(const FixedPriorityTask& demand, Interference& found) {
  found.rivals.push_back(demand);
  found.as_seen.push_back(demand);
}

// A SCHED_DEADLINE callback that never ran, and that the spec describes.
std::optional<FixedPriorityTask> declared_server_on(const SpecEntry* entry, std::uint32_t cpu) {
  if (entry == nullptr || entry->parameters.policy != Policy::deadline) return std::nullopt;
  const auto& asked = entry->parameters;
  if (asked.cpus && !may_use(*asked.cpus, cpu)) return std::nullopt;
  return demand_of({.runtime = signed_ns(asked.runtime_ns),
                    .deadline = signed_ns(asked.deadline_ns),
                    .period = signed_ns(asked.period_ns)});
}

// The same of a callback that never ran, and that the spec describes.
std::int32_t declared_priority_on(const SpecEntry* entry, std::uint32_t cpu) {
  if (entry == nullptr || !entry->wcet_ns || !entry->min_inter_arrival_ns) return 0;
  const auto& asked = entry->parameters;
  const bool is_fixed = asked.policy == Policy::fifo || asked.policy == Policy::round_robin;
  if (!is_fixed || (asked.cpus && !may_use(*asked.cpus, cpu))) return 0;
  return static_cast<std::int32_t>(asked.priority);
}

std::string may_be_missing(const ProcessReport& process) {
  const auto pid = pid_words(process);
  const auto or_until = process.has_ended ? std::string() : ", or until " + pid + " ends";
  return "callbacks of " + pid +
         ", one of which may preempt it, may be missing from the recording; record without losses" +
         or_until;
}

std::string named(const ThreadReport& thread) { return "thread " + std::to_string(thread.tid); }

}  // namespace

bool is_fixed_priority(const ThreadSchedReport& sched) noexcept {
  return has_priority(Policy{sched.policy});
}

bool is_deadline(const ThreadSchedReport& sched) noexcept {
  return Policy{sched.policy} == Policy::deadline;
}

DeadlineServer server_of(const ThreadSchedReport& sched) noexcept {
  return {.runtime = signed_ns(sched.runtime_ns),
          .deadline = signed_ns(sched.deadline_ns),
          .period = signed_ns(sched.period_ns)};
}

std::string in_us(std::int64_t ns) {
  return std::to_string(ns / 1000) + '.' + std::to_string(ns % 1000 / 100) + " us";
}

std::uint64_t known_runs(const CallbackReport& callback) noexcept {
  return callback.instances + callback.partly_seen() + callback.runs_not_seen;
}

std::string longer_execution(const Task& task) {
  if (is_declared(task.result.execution)) return {};
  if (auto unseen = unknown_runs(task); !unseen.empty()) return unseen;
  const auto& unmeasured = task.callback->longest_unmeasured;
  if (!unmeasured || unmeasured->ns <= task.result.execution->ns) return {};
  return "an instance that took longer was not measured";
}

std::string unmeasured_waiting(const Task& task) {
  if (!is_declared(task.result.execution)) return {};  // longer_execution() tells
  if (const auto unseen = unknown_runs(task); !unseen.empty())
    return unseen + "; record without losses, until its process ends";
  const auto& unmeasured = task.callback->longest_unmeasured;
  if (!unmeasured || unmeasured->ns <= task.result.execution->ns) return {};
  return "an instance that took longer than its wcet was not measured; " +
         how_to_measure(*task.callback);
}

std::string how_to_measure(const CallbackReport& callback) {
  return callback.execution_time ? "record without gaps in the kernel's record"
                                 : "record with --kernel";
}

std::vector<Breach> breaches(const Task& task) {
  std::vector<Breach> found;
  const auto& measured = task.callback->execution_time;
  const auto& execution = task.result.execution;
  const auto wcet = execution ? execution->ns - task.result.waiting_ns.value_or(0) : 0;
  if (is_declared(execution) && measured && measured->max > wcet) {
    found.push_back({.kind = "overrun",
                     .subject = "an instance",
                     .what = "executed " + in_us(measured->max) + ", declared are " + in_us(wcet)});
  }
  const auto shortest = shortest_arrival(*task.callback);
  const auto& period = task.result.period;
  if (is_declared(period) && shortest && shortest->ns < period->ns) {
    found.push_back(
        {.kind = "burst",
         .subject = "releases",
         .what = "came " + in_us(shortest->ns) + " apart, declared are " + in_us(period->ns)});
  }
  return found;
}

std::string broken_declaration(const Task& task) {
  const auto found = breaches(task);
  if (found.empty()) return {};
  return found.front().subject + " of " + task.callback->logical_id + ' ' + found.front().what;
}

FixedPriorityTask as_seen(const Task& task, FixedPriorityTask counted) {
  const auto& callback = *task.callback;
  if (callback.execution_time) {
    counted.execution =
        std::max(counted.execution, with_waiting(callback, callback.execution_time->max));
  }
  if (const auto shortest = shortest_arrival(callback); shortest && counted.period)
    counted.period = std::min(*counted.period, shortest->ns);
  return counted;
}

std::string nearer_releases(const Task& task) {
  const auto& callback = *task.callback;
  if (is_declared(task.result.period)) return {};
  if (callback.may_lack_runs) return kLacksRuns;
  const auto known = callback.inter_arrival ? callback.inter_arrival->count : 0;
  // Those at an edge are as the ones before and after the recording.
  const auto within =
      callback.instances + callback.incomplete - (is_one_in_progress(callback) ? 1U : 0U);
  const auto all = within - std::min<std::uint64_t>(within, 1);
  if (known >= all) return {};
  return std::to_string(all - known) + " of its " + std::to_string(all) + " inter-arrival times " +
         (all - known == 1 ? "is" : "are") + " not known";
}

std::string unknown_parameters(const ThreadReport& thread) {
  if (!thread.sched) return "the parameters of " + named(thread) + " are not known";
  if (!thread.former.empty()) return "the parameters of " + named(thread) + " changed";
  if (thread.may_lack_read_backs)
    return "read-backs of the parameters of " + named(thread) + " are missing from the recording";
  if (thread.is_contradicted) {
    return "the kernel shows " + named(thread) +
           " with other parameters than were read back (rules S3 and S4)";
  }
  if (thread.sched->cpus.empty()) return "the CPUs of " + named(thread) + " are not known";
  return {};
}

bool overlap(const TimeWindow& a, const TimeWindow& b) noexcept {
  return a.from <= b.to && b.from <= a.to;
}

const ThreadReport* Task::thread() const noexcept {
  return threads.size() == 1 ? threads.front() : nullptr;
}

const ThreadSchedReport* Task::sched() const noexcept {
  const auto* sole = thread();
  return sole != nullptr && sole->sched ? &*sole->sched : nullptr;
}

bool Task::is_pinned() const noexcept {
  const auto* known = sched();
  return known != nullptr && is_fixed_priority(*known) && known->cpus.size() == 1;
}

TaskModel::TaskModel(const Report& report, const SchedulingSpec* spec)
    : report_(report), rows_(report) {
  for (const auto& thread : report.threads) {
    bool is_server = false;
    for_each_known(thread, [&is_server](const ThreadSchedReport& known) {
      is_server = is_server || is_deadline(known);
    });
    if (is_server && !thread.callbacks.empty()) servers_.push_back(&thread);
  }
  tasks_.reserve(report.callbacks.size());
  for (const auto& callback : report.callbacks) {
    Task task{.callback = &callback, .process = &rows_.process_of(callback)};
    if (spec != nullptr)
      task.entry = spec->find_callback(callback.logical_id, callback.period_ns.value_or(0));
    for (const auto& on : callback.threads)
      task.threads.push_back(rows_.find(on.thread));
    auto& result = task.result;
    result.index = callback.index;
    result.process = callback.process;
    result.logical_id = callback.logical_id;
    result.execution = execution_of(callback, task.entry);
    result.period = period_of(callback, task.entry);
    result.deadline = deadline_of(callback, task.entry);
    result.runs = callback.instances;
    if (callback.execution_time) result.runs_measured = callback.execution_time->count;
    if (result.execution && callback.blocked) result.waiting_ns = callback.blocked->max;
    if (callback.response_time) result.observed_ns = callback.response_time->max;
    if (const auto longest = longest_response(callback)) {
      result.observed_at_least_ns = longest->ns;
      result.may_have_taken_longer = longest->is_bound;
    }
    const auto& open = callback.longest_open;
    if (open && open->response_least &&
        open->response_least->ns > result.observed_at_least_ns.value_or(0)) {
      result.observed_at_least_ns = open->response_least->ns;
      result.may_have_taken_longer = true;
    }
    if (callback.threads.size() == 1) result.tid = callback.threads.front().tid;
    if (const auto* sched = task.sched()) {
      result.policy = sched->policy_name;
      result.priority = sched->priority;
      result.cpus = sched->cpus;
      if (is_deadline(*sched) && task.thread()->former.empty())
        result.runtime_ns = signed_ns(sched->runtime_ns);
    }
    tasks_.push_back(std::move(task));
  }
}

Interference TaskModel::interference(const Processor& processor, std::int32_t least_priority,
                                     const TimeWindow& during, const Task* except) const {
  Interference found;
  const auto is_beside = [&](const ProcessReport& process, const TimeWindow& lived) {
    return process.host_index == processor.host && overlap(lived, during);
  };
  for (const auto& process : report_.processes) {
    if (!process.may_hide_callbacks || !is_beside(process, process.lived)) continue;
    found.unknown = may_be_missing(process);
    return found;
  }
  for (const auto& task : tasks_) {
    if (&task == except || !is_beside(*task.process, task.lived())) continue;
    add_callback(task, processor, least_priority, found);
    if (!found.unknown.empty()) return found;
  }
  for (const auto* server : servers_) {
    const auto& process = rows_.process_of(*server);
    if (!is_beside(process, process.lived)) continue;
    add_server(*server, processor, found);
    if (!found.unknown.empty()) return found;
  }
  return found;
}

// What begins adds to what lives, and what ends is no part of it after that.
std::vector<Demand> TaskModel::at_moments(const Processor& processor, std::int32_t least_priority,
                                          const TimeWindow& during) const {
  enum class Edge : std::uint8_t { begin, end };  // of one moment, both live
  std::vector<std::tuple<Timestamp, Edge, Demand>> edges;
  const auto add = [&](const ProcessReport& process, const TimeWindow& lived, const auto& find) {
    if (process.host_index != processor.host || !overlap(lived, during)) return;
    Interference found;
    find(found);
    if (found.rivals.empty()) return;
    const Demand demand{.ppb = demanded_ppb(found.rivals), .rivals = found.rivals.size()};
    edges.emplace_back(std::max(lived.from, during.from), Edge::begin, demand);
    edges.emplace_back(lived.to, Edge::end, demand);
  };
  for (const auto& task : tasks_) {
    add(*task.process, task.lived(),
        [&](Interference& found) { add_callback(task, processor, least_priority, found); });
  }
  for (const auto* server : servers_) {
    const auto& process = rows_.process_of(*server);
    add(process, process.lived,
        [&](Interference& found) { add_server(*server, processor, found); });
  }
  std::ranges::sort(edges, {}, [](const auto& edge) {
    return std::pair(std::get<Timestamp>(edge), std::get<Edge>(edge));
  });
  std::vector<Demand> found{{}};
  Int128 ppb = 0;
  std::size_t rivals = 0;
  for (const auto& [time, edge, demand] : edges) {
    const bool begins = edge == Edge::begin;
    ppb += begins ? demand.ppb : -static_cast<Int128>(demand.ppb);
    rivals += begins ? demand.rivals : 0 - demand.rivals;
    constexpr Int128 kMost = std::numeric_limits<std::int64_t>::max();
    if (begins)
      found.push_back({.ppb = static_cast<std::int64_t>(std::min(ppb, kMost)), .rivals = rivals});
  }
  return found;
}

void TaskModel::add_callback(const Task& task, const Processor& processor,
                             std::int32_t least_priority, Interference& found) const {
  const auto& callback = *task.callback;
  const bool is_described =
      task.entry != nullptr && task.entry->wcet_ns && task.entry->min_inter_arrival_ns;
  const bool has_run = callback.may_lack_runs || known_runs(callback) > 0;
  if (callback.threads.empty() && has_run && !(is_described && task.entry->parameters.policy)) {
    const bool is_outside = asked_window(report_.trace) && !callback.may_lack_runs;
    found.unknown = "all instances of " + callback.logical_id + ", which may preempt it, " +
                    (is_outside ? "lie outside the window" : "are missing from the recording");
    return;
  }
  if (callback.never_ran()) {
    if (const auto server = declared_server_on(task.entry, processor.cpu))
      add_server_demand(*server, found);
  }
  // An instance runs once, on whichever of its threads.
  auto priority = callback.never_ran() ? declared_priority_on(task.entry, processor.cpu) : 0;
  for (std::size_t i = 0; i < task.threads.size(); ++i) {
    const auto* thread = task.threads[i];
    if (thread == nullptr || !thread->sched) {
      found.unknown = "the parameters of thread " + std::to_string(callback.threads[i].tid) +
                      " are not known: " + callback.logical_id +
                      ", which ran on it, may preempt it";
      return;
    }
    if (thread->may_lack_read_backs || thread->is_contradicted) {
      found.unknown = unknown_parameters(*thread) + ": " + callback.logical_id +
                      ", which ran on it, may have preempted it";
      return;
    }
    priority = std::max(priority, priority_on(*thread, processor.cpu));
  }
  if (priority < std::max(least_priority, 1)) return;
  const auto& execution = task.result.execution;
  const auto& period = task.result.period;
  if (!execution) {
    found.unknown =
        "the execution time of " + callback.logical_id + ", which may preempt it, is not known";
  } else if (const auto longer = longer_execution(task); !longer.empty()) {
    found.unknown = "the longest execution time of " + callback.logical_id +
                    ", which may preempt it, is not known, because " + longer +
                    "; declare wcet in the spec";
  } else if (!unmeasured_waiting(task).empty()) {
    found.unknown = "how long " + callback.logical_id +
                    ", which may preempt it, waits within an instance is not known, because " +
                    unmeasured_waiting(task);
  } else if (!period && known_runs(callback) > 1) {
    found.unknown = "how often " + callback.logical_id +
                    ", which may preempt it, is released is not known; declare min_inter_arrival "
                    "in the spec";
  } else if (const auto nearer = nearer_releases(task); !nearer.empty()) {
    found.unknown = "how often " + callback.logical_id +
                    ", which may preempt it, is released is not known, because " + nearer +
                    "; declare min_inter_arrival in the spec";
  } else if (period && period->ns <= 0) {
    found.unknown = "releases of " + callback.logical_id +
                    ", which may preempt it, coincide: it may do so "
                    "any number of times; declare min_inter_arrival in the spec";
  } else {
    add_rival(task, priority, found);
  }
}

// Requires an execution time.
void TaskModel::add_rival(const Task& task, std::int32_t priority, Interference& found) {
  const auto& period = task.result.period;
  found.rivals.push_back({.execution = task.result.execution->ns,
                          .period = period ? std::optional(period->ns) : std::nullopt,
                          .priority = priority});
  found.as_seen.push_back(as_seen(task, found.rivals.back()));
  if (found.broken_declaration.empty()) found.broken_declaration = broken_declaration(task);
  for (const auto& breach : breaches(task)) {
    found.breaches.push_back({.kind = breach.kind,
                              .text = breach.subject + " of " + task.callback->logical_id +
                                      ", which its bound counts, " + breach.what});
  }
}

void TaskModel::add_server(const ThreadReport& thread, const Processor& processor,
                           Interference& found) {
  std::optional<FixedPriorityTask> demand;
  for_each_known(thread, [&](const ThreadSchedReport& known) {
    if (!is_deadline(known) || !may_use(known.cpus, processor.cpu)) return;
    constexpr std::uint64_t kReclaim = 0x02;  // SCHED_FLAG_RECLAIM of uapi/linux/sched.h
    const auto server = server_of(known);
    if ((known.flags & kReclaim) != 0) {
      found.unknown = named(thread) +
                      " may run for longer than its runtime: it reclaims what other "
                      "SCHED_DEADLINE threads leave (SCHED_FLAG_RECLAIM)";
    } else if (server.period <= 0 || server.runtime < 0 || server.deadline < server.runtime) {
      found.unknown = "the SCHED_DEADLINE parameters of " + named(thread) + " are no sound ones";
    } else if (demand) {
      found.unknown = "the parameters of " + named(thread) + ", which may preempt it, changed";
    } else {
      demand = demand_of(server);
    }
  });
  if (demand && found.unknown.empty()) add_server_demand(*demand, found);
}

}  // namespace cie::analysis
