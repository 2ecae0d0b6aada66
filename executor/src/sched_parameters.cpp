#include "sched_parameters.hpp"

#include <cie/tracepoints/sched_attr.hpp>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <memory>
#include <string_view>
#include <system_error>

#include <sched.h>
#include <unistd.h>

namespace cie::executor {
namespace {

bool is_real_time(Policy policy) noexcept {
  return policy == Policy::fifo || policy == Policy::round_robin || policy == Policy::deadline;
}

bool has_priority(Policy policy) noexcept {
  return policy == Policy::fifo || policy == Policy::round_robin;
}

bool has_nice(Policy policy) noexcept { return policy == Policy::other || policy == Policy::batch; }

std::string cpu_list(const std::vector<std::uint32_t>& cpus) {
  std::string text;
  for (const std::uint32_t cpu : cpus) {
    text.append(text.empty() ? "" : ",").append(std::to_string(cpu));
  }
  return text.empty() ? "none" : text;
}

std::string describe_policy(const ThreadParameters& parameters) {
  const Policy policy = *parameters.policy;
  std::string text{policy_name(policy)};
  if (has_priority(policy)) text += " " + std::to_string(parameters.priority);
  if (has_nice(policy)) text += " nice " + std::to_string(parameters.nice);
  if (parameters.slice_ns) text += " slice " + std::to_string(*parameters.slice_ns) + " ns";
  if (policy == Policy::deadline) {
    text += " " + std::to_string(parameters.runtime_ns) + "/" +
            std::to_string(parameters.deadline_ns) + "/" + std::to_string(parameters.period_ns) +
            " ns";
  }
  if (parameters.util_min) text += " uclamp_min " + std::to_string(*parameters.util_min);
  if (parameters.util_max) text += " uclamp_max " + std::to_string(*parameters.util_max);
  return text;
}

// The real-time budget of this process's cpu control group, where the kernel has such (version 1
// with RT_GROUP_SCHED); -1 otherwise.
std::int64_t group_rt_runtime_us() {
  std::ifstream groups{"/proc/self/cgroup"};
  for (std::string line; std::getline(groups, line);) {
    const auto first = line.find(':');
    const auto second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    if (controllers.find(",cpu,") == std::string::npos) continue;
    std::ifstream file{"/sys/fs/cgroup/cpu" + line.substr(second + 1) + "/cpu.rt_runtime_us"};
    std::int64_t runtime = -1;
    if (file >> runtime) return runtime;
  }
  return -1;
}

std::string remedy_for_policy(int error, const ThreadParameters& parameters) {
  const bool is_deadline = parameters.policy == Policy::deadline;
  switch (error) {
    case EPERM:
      if (has_priority(*parameters.policy) && group_rt_runtime_us() == 0) {
        return "the cpu control group has no real-time budget: write one to its "
               "cpu.rt_runtime_us, or leave the group";
      }
      if (is_deadline && parameters.cpus) {
        return "CAP_SYS_NICE is needed, and SCHED_DEADLINE does not go with a subset of the CPUs "
               "outside a cpuset of its own: remove the affinity";
      }
      return "CAP_SYS_NICE is needed: run as root, or with `setpriv --ambient-caps +sys_nice "
             "--inh-caps +sys_nice`";
    case EBUSY:
      return "the deadline threads together would exceed the CPU time that "
             "/proc/sys/kernel/sched_rt_runtime_us admits, or the thread may not use all CPUs: "
             "lower runtime/period or remove the affinity";
    case EINVAL:
      return is_deadline ? "the kernel wants 1024 ns <= runtime <= deadline <= period, and a "
                           "period of 100 us to 4 s"
                         : "the kernel does not take these values for this policy";
    default:
      return "the kernel gives no other reason";
  }
}

std::string words(int error, const std::string& remedy) {
  return std::generic_category().message(error) + " (" + remedy + ")";
}

struct FreeCpuSet {
  void operator()(cpu_set_t* set) const noexcept { CPU_FREE(set); }
};

int set_affinity(std::uint32_t tid, const std::vector<std::uint32_t>& cpus) {
  if (cpus.empty()) return EINVAL;
  const std::size_t count = std::size_t{cpus.back()} + 1;  // ascending
  const std::unique_ptr<cpu_set_t, FreeCpuSet> set{CPU_ALLOC(count)};
  if (set == nullptr) return ENOMEM;
  const std::size_t size = CPU_ALLOC_SIZE(count);
  CPU_ZERO_S(size, set.get());
  for (const std::uint32_t cpu : cpus)
    CPU_SET_S(cpu, size, set.get());
  return sched_setaffinity(static_cast<pid_t>(tid), size, set.get()) == 0 ? 0 : errno;
}

int set_policy(std::uint32_t tid, const ThreadParameters& parameters) noexcept {
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
  return set_sched_attr(tid, attributes);
}

}  // namespace

SchedRequest request(std::uint32_t tid, const ThreadParameters& parameters) {
  if (parameters.cpus) {
    if (const int error = set_affinity(tid, *parameters.cpus); error != 0) {
      return {.error = error,
              .what = "CPUs " + cpu_list(*parameters.cpus),
              .reason = words(error, error == EINVAL ? "none of these CPUs is online and allowed "
                                                       "to this process: see `nproc` and "
                                                       "`taskset -p`"
                                                     : "see `taskset -p` and the cpuset")};
    }
  }
  if (parameters.policy) {
    if (const int error = set_policy(tid, parameters); error != 0) {
      return {.error = error,
              .what = describe_policy(parameters),
              .reason = words(error, remedy_for_policy(error, parameters))};
    }
  }
  return {};
}

std::vector<std::string> differences(const ThreadParameters& asked,
                                     const trace::SchedReadBack& reported) {
  std::vector<std::string> found;
  const auto compare = [&found](std::string_view name, auto wanted, auto actual) {
    if (wanted == actual) return;
    found.push_back(std::string{name} + " is " + std::to_string(actual) + " instead of " +
                    std::to_string(wanted));
  };
  if (asked.policy) {
    const Policy policy = *asked.policy;
    if (reported.policy != static_cast<std::int32_t>(policy)) {
      const auto name = policy_name(static_cast<Policy>(reported.policy));
      found.push_back("policy is " +
                      (name.empty() ? std::to_string(reported.policy) : std::string{name}) +
                      " instead of " + std::string{policy_name(policy)});
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
    found.push_back("affinity is " + cpu_list(reported.cpus) + " instead of " +
                    cpu_list(*asked.cpus));
  }
  return found;
}

}  // namespace cie::executor
