// Schedulability of the callbacks of a recording: what theory says of the longest response times,
// from the recording's own parameters, against what was observed. Which assumptions it rests on:
// analysis/src/studies/README.md.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

// Where a number comes from: the spec (or the callback's own declaration) or the recording.
enum class ParameterSource : std::uint8_t { declared, measured };
std::string_view label(ParameterSource source) noexcept;

struct TaskParameter {
  std::int64_t ns = 0;
  ParameterSource source = ParameterSource::measured;
};

enum class BoundMethod : std::uint8_t { none, fixed_priority, deadline_server };
std::string_view label(BoundMethod method) noexcept;

// Something that the theory leaves out and that lengthened responses.
struct Explanation {
  std::string kind;     // "outside-thread", "idle-cpu", "thread", "kernel", "overrun", "burst"
  std::string text;     // with the numbers, for people
  std::int64_t ns = 0;  // how much of it there was in one instance at most
};

struct CallbackSchedulability {
  CallbackIndex index{};  // of its row of the report
  ProcessIndex process{};
  std::string logical_id;
  std::optional<std::int64_t> tid;  // empty: it ran on several threads or on none
  std::string policy;               // "SCHED_FIFO"; empty: unknown
  std::int64_t priority = 0;        // of SCHED_FIFO and SCHED_RR
  std::vector<std::uint32_t> cpus;  // that it may use
  std::optional<std::int64_t>
      runtime_ns{};                        // that its SCHED_DEADLINE thread may execute in a period
  std::optional<TaskParameter> execution;  // longest (C), time of waiting within it included
  std::uint64_t runs = 0;                  // complete instances,
  std::uint64_t runs_measured = 0;         // and of how many of them the execution time is known
  // The longest waiting seen within an instance, a part of C. Empty: not measured, and not in C.
  std::optional<std::int64_t> waiting_ns{};
  std::optional<TaskParameter> period;    // shortest inter-arrival time (T)
  std::optional<TaskParameter> deadline;  // relative to the release (D)
  BoundMethod method = BoundMethod::none;
  std::optional<std::int64_t> bound_ns;  // of the response time
  std::string reason;                    // why there is none, or why it decides no deadline
  // What was declared, of it or of another that its bound counts, and not kept; empty: all was.
  std::string broken_declaration{};
  std::optional<std::int64_t> observed_ns;  // longest response time of exact releases
  // What an instance took at least, those whose release is known by a bound only included;
  std::optional<std::int64_t> observed_at_least_ns{};
  bool may_have_taken_longer = false;     // one of the latter did, or may have
  std::vector<Explanation> explanations;  // only where observed is above bound
  bool is_flagged = false;                // it is above by more than they explain

  // As far as is certain. Requires that something was observed.
  std::int64_t longest_ns() const noexcept { return *std::max(observed_ns, observed_at_least_ns); }
  // By how much its execution exceeds its thread's runtime; waiting takes none. Not above 0 where it does
  // not, or one of both is not known.
  std::int64_t beyond_runtime_ns() const noexcept {
    return runtime_ns && execution ? execution->ns - waiting_ns.value_or(0) - *runtime_ns : 0;
  }
  bool executes_beyond_runtime() const noexcept { return beyond_runtime_ns() > 0; }
  bool is_above_bound() const noexcept {
    return bound_ns && std::max(observed_ns, observed_at_least_ns) > bound_ns;
  }
  // An instance took longer for certain.
  bool has_missed_deadline() const noexcept {
    return deadline && observed_at_least_ns && *observed_at_least_ns > deadline->ns;
  }
  // One that was missed is not met, whatever the bound. A bound that an instance was above holds
  // with what explains that. Empty without deadline or analysis, too.
  std::optional<bool> meets_deadline() const noexcept {
    if (!deadline) return std::nullopt;
    if (has_missed_deadline()) return false;
    if (method == BoundMethod::none) return std::nullopt;
    if (!bound_ns || *bound_ns > deadline->ns) return false;
    if (!broken_declaration.empty()) return std::nullopt;
    return !is_above_bound() || has_room_for_explanations() ? std::optional(true) : std::nullopt;
  }

 private:
  // They explain the excess, and are within the deadline beside the bound.
  bool has_room_for_explanations() const noexcept {
    if (is_flagged) return false;
    auto left = deadline->ns - *bound_ns;
    for (const auto& explanation : explanations) {
      if (explanation.ns > left) return false;
      left -= explanation.ns;
    }
    return true;
  }
};

// One CPU's share that the callbacks' threads demand at most, in parts per billion.
struct CpuDemand {
  std::string host{};  // where there are several, here and below
  std::uint32_t cpu = 0;
  // C / T of SCHED_FIFO and SCHED_RR, and reserved by SCHED_DEADLINE. Empty: of one it is unknown.
  std::optional<std::int64_t> real_time_ppb;
};

// The SCHED_DEADLINE threads of a host that share CPUs, directly or by others.
struct DeadlineAdmission {
  std::string host{};
  std::vector<std::uint32_t> cpus{};  // ascending
  std::size_t servers = 0;            // at the same time at most
  std::uint32_t processors = 0;
  std::optional<std::int64_t> reserved_ppb;  // of one processor; empty: a thread has no period
  std::int64_t admissible_ppb = 0;  // what the kernel admits by default: 95 % of each processor
  // An EDF test shows that each thread gets its runtime by its deadline. What a callback executes
  // beyond that is not in it. Empty: not known, `unknown` says why.
  std::optional<bool> is_guaranteed{};
  std::string unknown{};
};

struct SchedulabilityReport {
  std::vector<CallbackSchedulability> callbacks;  // in the order of the report
  std::vector<CpuDemand> cpus;                    // those that a callback's thread is pinned to
  std::vector<DeadlineAdmission> deadline;        // by host and CPUs
  // Real-time threads of the recording that run no callback: their demand is in no bound.
  std::vector<std::string> outside;

  // A deadline that is not guaranteed, or a response above its bound that nothing explains.
  bool has_finding() const noexcept;
  // Of the callbacks' deadlines: how many there are, and of how many it is known whether they are
  // met.
  std::size_t deadlines() const noexcept;
  std::size_t decided_deadlines() const noexcept;
  // There are deadlines, and nothing is known of any.
  bool is_undecided() const noexcept { return deadlines() > 0 && decided_deadlines() == 0; }
  // Why, in a few words. Requires is_undecided().
  std::string why_undecided() const;
};

// Pure; the same for the same report and spec. `spec` may be null: its wcet, min_inter_arrival and
// response_deadline are preferred to what was measured.
SchedulabilityReport schedulability_of(const Report& report, const SchedulingSpec* spec);

}  // namespace cie::analysis
