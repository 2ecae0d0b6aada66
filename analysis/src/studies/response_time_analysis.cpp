#include <cie/analysis/response_time_analysis.hpp>
#include <cie/analysis/statistics.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace cie::analysis {
namespace {

constexpr std::int64_t kForever = std::numeric_limits<std::int64_t>::max() / 4;
constexpr std::int64_t kMaxSteps = 1'000'000;

// Each of a step of every task.
std::int64_t steps_within(std::int64_t effort, std::size_t tasks) {
  return std::min(kMaxSteps, effort / static_cast<std::int64_t>(std::max<std::size_t>(tasks, 1)));
}

std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return a / b + (a % b != 0 ? 1 : 0); }

// ceil((time + J) / T) * C: what the task may demand in a window that begins with a release.
Int128 demand(const FixedPriorityTask& task, std::int64_t time) {
  const auto jobs = task.period ? ceil_div(time + task.jitter, *task.period) : 1;
  return static_cast<Int128>(std::max<std::int64_t>(jobs, 1)) * task.execution;
}

// The smallest w with w = base + the others' demand in w (Joseph & Pandya, "Finding Response Times
// in a Real-Time System", The Computer Journal 29(5), 1986; Audsley et al., "Applying New
// Scheduling Theory to Static Priority Pre-emptive Scheduling", Software Engineering Journal 8(5),
// 1993, with jitter). Found by iteration from below, which never passes it. Empty if there is none
// in reach.
std::optional<std::int64_t> fixed_point(std::span<const FixedPriorityTask> tasks, std::size_t index,
                                        Int128 base, bool is_with_itself, std::int64_t from,
                                        std::int64_t& steps_left) {
  auto w = from;
  for (; steps_left > 0; --steps_left) {
    Int128 next = base;
    for (std::size_t j = 0; j < tasks.size(); ++j) {
      if (j == index ? is_with_itself : tasks[j].priority >= tasks[index].priority) {
        next += demand(tasks[j], w);
      }
    }
    if (next > kForever) return std::nullopt;
    if (next == w) return w;
    w = static_cast<std::int64_t>(next);
  }
  return std::nullopt;
}

}  // namespace

// With jobs that may outlast their period the first one of a busy period need not be the worst:
// Lehoczky, "Fixed Priority Scheduling of Periodic Task Sets with Arbitrary Deadlines", RTSS 1990:
//   L   = B + sum over tasks j at least as urgent, i included, of ceil((L + J_j) / T_j) C_j
//   w_q = B + (q + 1) C_i + sum over the others of ceil((w_q + J_j) / T_j) C_j
//   R   = max over q = 0 .. ceil((L + J_i) / T_i) - 1 of J_i + w_q - q T_i
std::optional<std::int64_t> worst_response_time(std::span<const FixedPriorityTask> tasks,
                                                std::size_t index, std::int64_t effort) {
  const auto& task = tasks[index];
  const auto is_impossible = [](const FixedPriorityTask& t) {
    return t.execution < 0 || (t.period && *t.period <= 0) || t.jitter < 0 || t.jitter > kForever ||
           t.blocking < 0;
  };
  for (const auto& other : tasks) {
    if (other.priority >= task.priority && is_impossible(other)) return std::nullopt;
  }
  auto steps_left = steps_within(effort, tasks.size());
  const auto busy = fixed_point(tasks, index, task.blocking, true,
                                std::max<std::int64_t>(task.execution, 1), steps_left);
  if (!busy) return std::nullopt;
  const auto jobs = task.period ? ceil_div(*busy + task.jitter, *task.period) : 1;
  std::int64_t worst = 0;
  std::int64_t w = 0;
  for (std::int64_t q = 0; q < jobs; ++q) {
    const auto base = task.blocking + static_cast<Int128>(q + 1) * task.execution;
    if (base > kForever) return std::nullopt;
    const auto start = std::max(w, static_cast<std::int64_t>(base));  // w_q grows with q
    const auto end = fixed_point(tasks, index, base, false, start, steps_left);
    if (!end) return std::nullopt;
    w = *end;
    worst = std::max(worst, task.jitter + w - (task.period ? q * *task.period : 0));
  }
  return worst;
}

namespace {

// Numbers from a forged recording may be of any size.
std::int64_t saturated(Int128 ppb) {
  return static_cast<std::int64_t>(
      std::clamp<Int128>(ppb, 0, std::numeric_limits<std::int64_t>::max()));
}

Int128 share_ppb(std::int64_t execution, std::int64_t period) {
  return (static_cast<Int128>(execution) * kWholeProcessorPpb + period - 1) / period;
}

}  // namespace

std::int64_t demanded_ppb(std::span<const FixedPriorityTask> tasks) {
  Int128 sum = 0;
  for (const auto& task : tasks) {
    if (task.period) sum += share_ppb(task.execution, *task.period);
  }
  return saturated(sum);
}

bool demand_exceeds_processor(std::int64_t ppb, std::size_t tasks) {
  const auto rounding = static_cast<std::int64_t>(tasks);
  return ppb - rounding > kWholeProcessorPpb;
}

bool demand_exceeds_processor(std::span<const FixedPriorityTask> tasks) {
  return demand_exceeds_processor(demanded_ppb(tasks), tasks.size());
}

std::int64_t reserved_ppb(std::span<const DeadlineServer> servers) {
  Int128 sum = 0;
  for (const auto& server : servers)
    sum += share_ppb(server.runtime, server.period);
  return saturated(sum);
}

namespace {

// Goossens, Funk, Baruah, "Priority-Driven Scheduling of Periodic Task Systems on Multiprocessors",
// Real-Time Systems 25, 2003, with densities C / min(D, T) in place of utilizations:
//   sum of densities <= m - (m - 1) * largest density
// Each in parts of a whole that all periods divide, so that no part is rounded; where that is too
// large, in parts of a large one, rounded up.
bool is_density_low(std::span<const DeadlineServer> servers, std::int64_t processors) {
  constexpr auto kMost = std::int64_t{1} << 62U;
  std::int64_t parts = 1;
  for (const auto& server : servers) {
    const auto factor = server.deadline / std::gcd(parts, server.deadline);
    if (parts > kMost / factor) {
      parts = kMost;
      break;
    }
    parts *= factor;
  }
  const Int128 whole = parts;
  Int128 sum = 0;
  Int128 largest = 0;
  for (const auto& server : servers) {
    const auto density = (server.runtime * whole + server.deadline - 1) / server.deadline;
    sum += density;
    largest = std::max(largest, density);
  }
  return sum <= processors * whole - (processors - 1) * largest;
}

// Processor demand: sum over servers of max(0, floor((t - D) / T) + 1) * C.
Int128 demand_until(std::span<const DeadlineServer> servers, std::int64_t time) {
  Int128 sum = 0;
  for (const auto& server : servers) {
    if (time < server.deadline) continue;
    sum += static_cast<Int128>((time - server.deadline) / server.period + 1) * server.runtime;
  }
  return sum;
}

// Baruah, Rosier, Howell, "Algorithms and Complexity Concerning the Preemptive Scheduling of
// Periodic, Real-Time Tasks on One Processor", Real-Time Systems 2, 1990: demand(t) <= t at every
// deadline t up to the end of the first busy period.
bool is_demand_met(std::span<const DeadlineServer> servers, std::int64_t effort) {
  std::vector<FixedPriorityTask> tasks;
  for (const auto& server : servers)
    tasks.push_back({.execution = server.runtime, .period = server.period});
  auto steps_left = steps_within(effort, servers.size());
  const auto busy = fixed_point(tasks, 0, 0, true, 1, steps_left);
  if (!busy) return false;
  for (const auto& server : servers) {
    for (auto deadline = server.deadline; deadline <= *busy; deadline += server.period) {
      if (--steps_left < 0 || demand_until(servers, deadline) > deadline) return false;
    }
  }
  return true;
}

}  // namespace

bool are_deadlines_guaranteed(std::span<const DeadlineServer> servers, std::uint32_t processors,
                              std::int64_t effort) {
  if (servers.empty()) return true;
  const auto is_sound = [](const DeadlineServer& server) {
    return server.runtime > 0 && server.runtime <= server.deadline &&
           server.deadline <= server.period && server.period <= kForever;
  };
  if (processors == 0 || !std::ranges::all_of(servers, is_sound)) return false;
  if (is_density_low(servers, processors)) return true;
  return processors == 1 && is_demand_met(servers, effort);
}

// Abeni & Buttazzo, "Integrating Multimedia Applications in Hard Real-Time Systems", RTSS 1998: a
// job that needs n budgets ends by the deadline of the n-th, which lies (n - 1) T + D after its
// release.
std::optional<std::int64_t> server_response_time(const DeadlineServer& server,
                                                 std::int64_t execution, std::int64_t period) {
  if (server.runtime <= 0 || server.period <= 0) return std::nullopt;
  const auto budgets = std::max<std::int64_t>(ceil_div(execution, server.runtime), 1);
  const auto served = static_cast<Int128>(budgets) * server.period;
  if (served > period) return std::nullopt;
  return static_cast<std::int64_t>(served) - server.period + server.deadline;
}

}  // namespace cie::analysis
