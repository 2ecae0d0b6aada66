#include "thread_facts.hpp"

#include <cie/tracepoints/policy.hpp>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace cie::analysis {

std::int32_t kernel_priority(const ReadBack& read_back) {
  return cie::kernel_priority(static_cast<Policy>(read_back.policy), read_back.nice,
                              read_back.priority);
}

std::int32_t without_idle_nice(const ReadBack& read_back, std::int32_t prio) {
  const bool is_idle = static_cast<Policy>(read_back.policy) == Policy::idle;
  return is_idle && !is_real_time_priority(prio) ? kernel_priority(read_back) : prio;
}

bool is_same_parameters(const ReadBack& a, const ReadBack& b) {
  if (a.policy != b.policy || a.cpus != b.cpus) return false;
  switch (static_cast<Policy>(a.policy)) {
    case Policy::fifo:
    case Policy::round_robin:
      return a.priority == b.priority;
    case Policy::deadline:
      return a.runtime_ns == b.runtime_ns && a.deadline_ns == b.deadline_ns &&
             a.period_ns == b.period_ns;
    case Policy::other:
    case Policy::batch:
      return a.nice == b.nice;
    case Policy::idle:
      return true;
  }
  return a.priority == b.priority && a.nice == b.nice;
}

void note_cpu(std::vector<UsedCpu>& cpus, const EventRef& where) {
  constexpr std::size_t kMostKept = 4096;  // no machine has more; a forged recording may
  const auto found =
      std::ranges::find(cpus, where.cpu, [](const UsedCpu& used) { return used.first.cpu; });
  if (found != cpus.end()) {
    found->last = where;
  } else if (cpus.size() < kMostKept) {
    cpus.push_back({.first = where, .last = where});
  }
}

void forget_kernel_record(ThreadFacts& thread) {
  thread.kernel_exit.reset();
  thread.is_tid_given_anew = false;
  thread.switched_in.reset();
  thread.raised_priority.reset();
  thread.lowered_priority.reset();
  thread.perhaps_inherited.reset();
  thread.scheduled.clear();
  thread.switches_checked = 0;
  thread.cpus_checked -= std::exchange(thread.switch_cpus_checked, 0);
  thread.cpu_violation.reset();
  thread.first_wait.reset();
  thread.busy_ns.reset();
}

void note_applied(ThreadFacts& thread, const ReadBack& read_back) {
  constexpr std::size_t kMostKept = 1024;
  auto& applied = thread.applied;
  const bool is_last = applied.empty() || !is_older(read_back, applied.back());
  if (applied.size() < kMostKept) {
    applied.insert(is_last ? applied.end() : std::prev(applied.end()), read_back);
  } else if (is_last) {
    applied.back() = read_back;
  }
}

std::optional<Timestamp> birth_of(const ThreadFacts& thread) {
  if (thread.start_ns) return Timestamp{*thread.start_ns};
  return thread.first_seen ? std::optional(thread.first_seen->time) : std::nullopt;
}

}  // namespace cie::analysis
