#include "parameter_words.hpp"

#include "base/cpu_list.hpp"

namespace cie::analysis {
namespace {

std::string describe_policy(Policy policy, std::int32_t nice, std::uint32_t priority,
                            std::uint64_t runtime, std::uint64_t deadline, std::uint64_t period) {
  const auto name = policy_name(policy);
  std::string text(name.empty() ? "policy " + std::to_string(static_cast<std::int32_t>(policy))
                                : std::string(name));
  switch (policy) {
    case Policy::fifo:
    case Policy::round_robin:
      return text + " " + std::to_string(priority);
    case Policy::other:
    case Policy::batch:
      return text + " nice " + std::to_string(nice);
    case Policy::deadline:
      return text + " " + std::to_string(runtime) + "/" + std::to_string(deadline) + "/" +
             std::to_string(period);
    case Policy::idle:
      return text;
  }
  text += " nice " + std::to_string(nice);  // of one that is not known, all that it may have
  return priority == 0 ? text : text + " priority " + std::to_string(priority);
}

}  // namespace

std::string priority_text(std::int32_t prio) {
  if (prio < 0) return "priority of SCHED_DEADLINE";
  if (is_real_time_priority(prio)) return "real-time priority " + std::to_string(99 - prio);
  return "nice " + std::to_string(prio - 120);
}

std::string describe(const ReadBack& read) {
  std::string text = describe_policy(Policy{read.policy}, read.nice, read.priority, read.runtime_ns,
                                     read.deadline_ns, read.period_ns);
  if (read.slice_ns.value_or(0) != 0) text += " slice " + std::to_string(*read.slice_ns) + " ns";
  const bool is_clamped = read.util_min.value_or(0) != 0 || read.util_max.value_or(1024) < 1024;
  if (is_clamped && read.util_max != 0U) {
    text += " uclamp " + std::to_string(read.util_min.value_or(0)) + ".." +
            std::to_string(read.util_max.value_or(1024));
  }
  return text + " on CPUs " + cpu_list(read.cpus);
}

std::string describe(const ThreadParameters& asked) {
  std::string text = asked.policy
                         ? describe_policy(*asked.policy, asked.nice, asked.priority,
                                           asked.runtime_ns, asked.deadline_ns, asked.period_ns)
                         : "any policy";
  if (asked.slice_ns) text += " slice " + std::to_string(*asked.slice_ns) + " ns";
  if (asked.util_min) text += " uclamp_min " + std::to_string(*asked.util_min);
  if (asked.util_max) text += " uclamp_max " + std::to_string(*asked.util_max);
  return text += asked.cpus ? " on CPUs " + cpu_list(*asked.cpus) : " on any CPU";
}

}  // namespace cie::analysis
