// The callbacks of a report as tasks of scheduling theory, and what may run in their place.
#pragma once

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/response_time_analysis.hpp>
#include <cie/analysis/schedulability.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::analysis {

// SCHED_FIFO and SCHED_RR.
bool is_fixed_priority(const ThreadSchedReport& sched) noexcept;
bool is_deadline(const ThreadSchedReport& sched) noexcept;
DeadlineServer server_of(const ThreadSchedReport& sched) noexcept;
// Both lived for a moment, as far as is known.
bool overlap(const TimeWindow& a, const TimeWindow& b) noexcept;

// A declaration that runs did not keep.
struct Breach {
  std::string kind;     // as of Explanation
  std::string subject;  // "an instance"
  std::string what;     // "executed 3.0 us, declared are 1.0 us"
};

// A CPU; those of several hosts share only their numbers.
struct Processor {
  HostIndex host{};
  std::uint32_t cpu = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
  friend auto operator<=>(const Processor&, const Processor&) = default;
};

// One callback with the threads that it ran on.
struct Task {
  const CallbackReport* callback = nullptr;
  const ProcessReport* process = nullptr;
  const SpecEntry* entry = nullptr;            // of the spec; null: it has none
  std::vector<const ThreadReport*> threads{};  // null: of one the report has no row
  CallbackSchedulability result{};
  // Where there is a bound: what runs did beyond C and T, its own and others' that the bound counts,
  std::vector<Explanation> breaches{};
  // and the bound that holds for these, too. Empty: there is none.
  std::optional<std::int64_t> bound_as_seen_ns{};

  TimeWindow lived() const noexcept { return life_of(*callback, *process); }
  // Null: it ran on none or on several.
  const ThreadReport* thread() const noexcept;
  // Of that thread; null also where they are not known.
  const ThreadSchedReport* sched() const noexcept;
  // It has a fixed priority and one CPU.
  bool is_pinned() const noexcept;
  Processor processor() const { return {process->host_index, sched()->cpus.front()}; }
};

// What may run in place of a task.
struct Interference {
  std::vector<FixedPriorityTask> rivals{};
  std::vector<FixedPriorityTask> as_seen{};  // the same, with C and T that no run was seen beyond
  std::string unknown{};                     // why that is not all; empty: it is
  std::string broken_declaration{};          // of one of them; empty: they kept theirs
  std::vector<Explanation> breaches{};       // of all of them; `ns` is not set
};

// In the long run, of one processor.
struct Demand {
  std::int64_t ppb = 0;    // as demanded_ppb() says
  std::size_t rivals = 0;  // that demand it
};

// "12.5 us".
std::string in_us(std::int64_t ns);
// That were seen, or a part of them, or that the recording proves.
std::uint64_t known_runs(const CallbackReport& callback) noexcept;
// Why a run may have executed for longer than the task's longest one; empty: none did, or it is
// declared. Requires an execution time.
std::string longer_execution(const Task& task);
// Why what a run waits may be in no C: a measured one may have waited for longer than is known, and what
// is declared is execution time alone. Empty: all that ended is known to have taken no longer than C.
std::string unmeasured_waiting(const Task& task);
// Advice where execution and waiting were not measured of all instances: none was without the kernel's
// events.
std::string how_to_measure(const CallbackReport& callback);
std::vector<Breach> breaches(const Task& task);
// C and T that no run is known to have been beyond. Requires both of `counted`.
FixedPriorityTask as_seen(const Task& task, FixedPriorityTask counted);
// What was declared of it and not kept, with the numbers; empty: it kept all, as far as is known.
std::string broken_declaration(const Task& task);
// Why releases may have come nearer to each other than is known; empty: none did, or it is declared.
std::string nearer_releases(const Task& task);
// Why a thread's parameters are not known, or were not always what they are; empty: they are.
std::string unknown_parameters(const ThreadReport& thread);

// Borrows report and spec.
class TaskModel {
 public:
  TaskModel(const Report& report, const SchedulingSpec* spec);

  std::vector<Task>& tasks() noexcept { return tasks_; }
  const std::vector<Task>& tasks() const noexcept { return tasks_; }
  const ReportRows& rows() const noexcept { return rows_; }

  // What other callbacks than `except` and the SCHED_DEADLINE threads of callbacks demand of a CPU
  // that they may use, at that priority or a higher one, of what lived then: all of what they
  // demand, wherever it ran.
  Interference interference(const Processor& processor, std::int32_t least_priority,
                            const TimeWindow& during, const Task* except) const;
  // The same of all callbacks at moments of that time, so many that all that ever ran at the same
  // time did so at one of them. Requires that nothing of it is unknown.
  std::vector<Demand> at_moments(const Processor& processor, std::int32_t least_priority,
                                 const TimeWindow& during) const;

 private:
  static void add_rival(const Task& task, std::int32_t priority, Interference& found);
  void add_callback(const Task& task, const Processor& processor, std::int32_t least_priority,
                    Interference& found) const;
  static void add_server(const ThreadReport& thread, const Processor& processor,
                         Interference& found);

  const Report& report_;
  ReportRows rows_;
  std::vector<Task> tasks_;
  std::vector<const ThreadReport*> servers_;  // that ran callbacks and SCHED_DEADLINE, at any time
};

}  // namespace cie::analysis
