// The classical schedulability tests of one processor, over plain numbers. All times are integers
// of one unit (nanoseconds here). Sources are named beside each formula in the implementation.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace cie::analysis {

// A sporadic task under fixed-priority preemptive scheduling.
struct FixedPriorityTask {
  std::int64_t execution = 0;          // longest demand of one job (C)
  std::optional<std::int64_t> period;  // shortest time between releases (T); empty: one job only
  std::int32_t priority = 0;           // larger is more urgent
  std::int64_t jitter = 0;             // longest delay from a job's arrival to its release (J)
  std::int64_t blocking = 0;  // longest time that less urgent tasks keep it from running (B)
};

// What a test may cost: so many times it asks what one task or server demands. Near a utilization
// of 1 busy periods are of any length.
inline constexpr std::int64_t kMaxEffort = 200'000'000;

// The longest time from arrival to end of any job of tasks[index], whatever the phases. Tasks of
// equal priority count as more urgent than each other, which bounds any order among them. Empty: no
// bound exists, or it lies beyond what integers hold or that effort finds. Deadlines play no part:
// busy periods of several jobs are examined whole.
std::optional<std::int64_t> worst_response_time(std::span<const FixedPriorityTask> tasks,
                                                std::size_t index,
                                                std::int64_t effort = kMaxEffort);

// One whole processor, in parts per billion.
inline constexpr std::int64_t kWholeProcessorPpb = 1'000'000'000;

// Parts per billion of one processor that the tasks demand in the long run (C / T; of a single job
// nothing), rounded up one by one. Requires periods above 0.
std::int64_t demanded_ppb(std::span<const FixedPriorityTask> tasks);
// So many tasks that demand so much demand more than all of one for certain: then the least urgent
// of them has no bound.
bool demand_exceeds_processor(std::int64_t ppb, std::size_t tasks);
bool demand_exceeds_processor(std::span<const FixedPriorityTask> tasks);

// A constant-bandwidth server: SCHED_DEADLINE's runtime, deadline, period.
struct DeadlineServer {
  std::int64_t runtime = 0;
  std::int64_t deadline = 0;
  std::int64_t period = 0;
  friend bool operator==(const DeadlineServer&, const DeadlineServer&) = default;
};

// Parts per billion of one processor that the servers reserve, rounded up one by one. Requires
// periods above 0.
std::int64_t reserved_ppb(std::span<const DeadlineServer> servers);

// Whether the servers meet every deadline under EDF on so many processors: on one by the processor
// demand criterion, which is exact for independent sporadic servers; on several by the density
// test, which suffices and is not necessary. False also where deciding would take too long.
bool are_deadlines_guaranteed(std::span<const DeadlineServer> servers, std::uint32_t processors,
                              std::int64_t effort = kMaxEffort);

// The longest time from release to end of a job of `execution` on a server whose deadlines are
// guaranteed, if jobs are `period` apart at least. Empty: jobs come faster than it serves them.
std::optional<std::int64_t> server_response_time(const DeadlineServer& server,
                                                 std::int64_t execution, std::int64_t period);

}  // namespace cie::analysis
