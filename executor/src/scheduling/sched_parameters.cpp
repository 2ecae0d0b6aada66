#include "sched_parameters.hpp"

#include "base/cpu_list.hpp"
#include "refusal.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

namespace cie::scheduling {

namespace {

std::string cpus_or_none(const std::vector<std::uint32_t>& cpus) {
  return cpus.empty() ? "none" : cpu_list(cpus);
}

std::string describe_policy(const ThreadParameters& parameters) {
  const Policy policy = *parameters.policy;
  std::string text{policy_name(policy)};
  const auto out = std::back_inserter(text);
  if (has_priority(policy)) fmt::format_to(out, " {}", parameters.priority);
  if (has_nice(policy)) fmt::format_to(out, " nice {}", parameters.nice);
  if (parameters.slice_ns) fmt::format_to(out, " slice {} ns", *parameters.slice_ns);
  if (policy == Policy::deadline) {
    fmt::format_to(out, " {}/{}/{} ns", parameters.runtime_ns, parameters.deadline_ns,
                   parameters.period_ns);
  }
  if (parameters.util_min) fmt::format_to(out, " uclamp_min {}", *parameters.util_min);
  if (parameters.util_max) fmt::format_to(out, " uclamp_max {}", *parameters.util_max);
  return text;
}

SchedRequest request_cpus(KernelCalls& calls, std::uint32_t tid, const ThreadParameters& parameters,
                          ExclusiveCpusets& cpusets) {
  if (parameters.has_exclusive_cpuset && parameters.cpus)
    return cpusets.join(tid, *parameters.cpus);
  cpusets.leave(tid);
  // What is so already is not asked for: a SCHED_DEADLINE thread may not even ask.
  if (!parameters.cpus) return {};
  const auto now = calls.read_back(tid);
  if (now && now->cpus == *parameters.cpus) return {};
  const int error = calls.set_affinity(tid, *parameters.cpus);
  if (error == 0) return {};
  return {.error = error,
          .what = "CPUs " + cpus_or_none(*parameters.cpus),
          .reason = why_affinity_refused(error, cpusets.kernel())};
}

SchedAttr attributes_of(const ThreadParameters& parameters) noexcept {
  const Policy policy = *parameters.policy;
  SchedAttr attributes;
  attributes.policy = static_cast<std::uint32_t>(policy);
  if (is_real_time(policy)) attributes.flags = kSchedFlagResetOnFork;
  if (has_nice(policy)) attributes.nice = parameters.nice;
  if (has_priority(policy)) attributes.priority = parameters.priority;
  if (parameters.slice_ns) attributes.runtime = *parameters.slice_ns;
  if (parameters.util_min) {
    attributes.flags |= kSchedFlagUtilMin;
    attributes.util_min = *parameters.util_min;
  }
  if (parameters.util_max) {
    attributes.flags |= kSchedFlagUtilMax;
    attributes.util_max = *parameters.util_max;
  }
  if (policy == Policy::deadline) {
    attributes.runtime = parameters.runtime_ns;
    attributes.deadline = parameters.deadline_ns;
    attributes.period = parameters.period_ns;
  }
  return attributes;
}

}  // namespace

SchedRequest request(KernelCalls& calls, std::uint32_t tid, const ThreadParameters& parameters,
                     ExclusiveCpusets& cpusets) {
  const auto now = calls.read_back(tid);
  const bool was_deadline = now && Policy{now->policy} == Policy::deadline;
  const bool leaves_deadline =
      was_deadline && parameters.policy && parameters.policy != Policy::deadline;
  if (!leaves_deadline) {
    if (auto refusal = request_cpus(calls, tid, parameters, cpusets); refusal.error != 0)
      return refusal;
  }
  if (parameters.policy) {
    if (const int error = calls.set_attributes(tid, attributes_of(parameters)); error != 0) {
      return {.error = error,
              .what = describe_policy(parameters),
              .reason = why_policy_refused(error, parameters, cpusets.kernel())};
    }
  }
  return leaves_deadline ? request_cpus(calls, tid, parameters, cpusets) : SchedRequest{};
}

std::vector<std::string> differences(const ThreadParameters& asked,
                                     const trace::SchedReadBack& reported) {
  std::vector<std::string> found;
  const auto compare = [&found](std::string_view name, auto wanted, auto actual) {
    if (wanted == actual) return;
    found.push_back(fmt::format("{} is {} instead of {}", name, actual, wanted));
  };
  if (asked.policy) {
    const Policy policy = *asked.policy;
    if (reported.policy != static_cast<std::int32_t>(policy)) {
      const auto name = policy_name(static_cast<Policy>(reported.policy));
      found.push_back(fmt::format(
          "policy is {} instead of {}",
          name.empty() ? fmt::to_string(reported.policy) : std::string{name}, policy_name(policy)));
    }
    if (has_nice(policy)) compare("nice", asked.nice, reported.nice);
    if (asked.slice_ns) {
      compare("slice", *asked.slice_ns, reported.slice_ns);
      if (reported.slice_ns == 0 && !found.empty()) found.back() += " (it needs Linux 6.12)";
    }
    if (asked.util_min) compare("uclamp_min", *asked.util_min, reported.util_min);
    if (asked.util_max) compare("uclamp_max", *asked.util_max, reported.util_max);
    if (has_priority(policy)) compare("priority", asked.priority, reported.priority);
    if (policy == Policy::deadline) {
      compare("runtime", asked.runtime_ns, reported.runtime_ns);
      compare("deadline", asked.deadline_ns, reported.deadline_ns);
      compare("period", asked.period_ns, reported.period_ns);
    }
  }
  if (asked.cpus && *asked.cpus != reported.cpus) {
    found.push_back(fmt::format("affinity is {} instead of {}", cpus_or_none(reported.cpus),
                                cpus_or_none(*asked.cpus)));
  }
  return found;
}

}  // namespace cie::scheduling
