#include "refusal.hpp"

#include <cie/tracepoints/policy.hpp>

#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace cie::scheduling {
namespace {

constexpr const char* kGiveSysNice =
    "run as root, or with `setpriv --inh-caps +sys_nice --ambient-caps +sys_nice`";

// 0.1 %, without floating point.
std::string percent(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return "?";
  const std::uint64_t tenths = (part * 1000 + whole / 2) / whole;
  return fmt::format("{}.{} %", tenths / 10, tenths % 10);
}

std::optional<std::string> no_real_time_budget(Policy policy, const KernelView& kernel) {
  if (!is_real_time(policy)) return std::nullopt;
  if (kernel.kernel_setting("sched_rt_runtime_us") == 0) {
    return "real-time throttling leaves no time: /proc/sys/kernel/sched_rt_runtime_us is 0; write "
           "950000 to it";
  }
  if (!has_priority(policy)) return std::nullopt;
  const auto group = kernel.group("cpu");
  if (!group) return std::nullopt;
  const auto budget = group->folder / "cpu.rt_runtime_us";
  if (KernelView::number(budget) != 0) return std::nullopt;
  return "the cpu control group has no real-time budget, which this kernel asks of every group: "
         "write one to " +
         budget.string() + ", or start the process in another group";
}

// What stands for CAP_SYS_NICE where a request asks for no more than it allows.
struct Limit {
  const char* name;
  const char* in_proc;  // as /proc/self/limits calls it
  const char* option;   // of ulimit
  std::int64_t needed;
};

std::optional<Limit> limit_in_place(const ThreadParameters& asked) {
  if (has_priority(*asked.policy)) {
    return Limit{.name = "RLIMIT_RTPRIO",
                 .in_proc = "Max realtime priority",
                 .option = "-r",
                 .needed = static_cast<std::int64_t>(asked.priority)};
  }
  if (*asked.policy == Policy::deadline) return std::nullopt;
  constexpr std::int64_t kOfNiceZero = 20;
  return Limit{.name = "RLIMIT_NICE",
               .in_proc = "Max nice priority",
               .option = "-e",
               .needed = kOfNiceZero - asked.nice};
}

std::string why_without_capability(const ThreadParameters& asked, const KernelView& kernel) {
  const auto limit = limit_in_place(asked);
  if (!limit) {
    return std::string{"CAP_SYS_NICE is needed, no limit stands for it: "} + kGiveSysNice;
  }
  const auto now = kernel.limit(limit->in_proc);
  if (!now || std::cmp_less(*now, limit->needed)) {
    return fmt::format("CAP_SYS_NICE is needed, or {} of at least {}{}: {}, or raise `ulimit {}`",
                       limit->name, limit->needed, now ? fmt::format(" (it is {})", *now) : "",
                       kGiveSysNice, limit->option);
  }
  if (const auto budget = no_real_time_budget(*asked.policy, kernel)) return *budget;
  const auto enough = fmt::format("{} is high enough (it is {})", limit->name,
                                  *now == kUnlimited ? "unlimited" : std::to_string(*now));
  if (is_real_time(*asked.policy)) {
    return enough + ": a security module, or the seccomp filter of a container, forbids it";
  }
  return fmt::format(
      "{}, but CAP_SYS_NICE is needed to take back the reset-on-fork of a real-time thread: {}",
      enough, kGiveSysNice);
}

std::string why_not_permitted(const ThreadParameters& asked, const KernelView& kernel) {
  if (!kernel.has_capability(kCapSysNice)) return why_without_capability(asked, kernel);
  if (const auto budget = no_real_time_budget(*asked.policy, kernel)) return *budget;
  if (!kernel.is_in_first_user_namespace()) {
    return "CAP_SYS_NICE of a user namespace does not count for it: give the capability to the "
           "container's host process, or do without the user namespace";
  }
  if (asked.policy == Policy::deadline) {
    const std::string cpus = kernel.allowed_cpus().value_or("some");
    return "SCHED_DEADLINE goes only with all CPUs of a cpuset, and the thread may use CPUs " +
           cpus +
           (asked.cpus ? ": remove the affinity, or let it have a cpuset of its own with "
                         "`cpuset: exclusive`"
                       : ": start the process without `taskset`");
  }
  return "the thread has CAP_SYS_NICE: a security module, or the seccomp filter of a container, "
         "forbids it";
}

std::string why_not_admitted(const ThreadParameters& asked, const KernelView& kernel) {
  const auto runtime = kernel.kernel_setting("sched_rt_runtime_us");
  const auto period = kernel.kernel_setting("sched_rt_period_us");
  std::string share = "the share";
  if (runtime && period && *runtime >= 0 && *period > 0) {
    share =
        "the " + percent(static_cast<std::uint64_t>(*runtime), static_cast<std::uint64_t>(*period));
  }
  return "admission: with the " + percent(asked.runtime_ns, asked.period_ns) +
         " of a CPU that it asks for, the deadline threads of the machine would exceed " + share +
         " of each CPU that sched_rt_runtime_us of sched_rt_period_us admits: lower runtime/period "
         "of some";
}

std::string why_invalid(const ThreadParameters& asked, const KernelView& kernel) {
  if (asked.policy != Policy::deadline) {
    return "the kernel does not take these values for this policy";
  }
  const auto least = kernel.kernel_setting("sched_deadline_period_min_us").value_or(kLeastPeriodUs);
  const auto most = kernel.kernel_setting("sched_deadline_period_max_us").value_or(kMostPeriodUs);
  return fmt::format(
      "the kernel wants 1024 ns <= runtime <= deadline <= period, and a period of {} us to {} us",
      least, most);
}

}  // namespace

std::string refused(int error, const std::string& remedy) {
  return std::generic_category().message(error) + " (" + remedy + ")";
}

std::string why_policy_refused(int error, const ThreadParameters& asked, const KernelView& kernel) {
  const bool has_clamps = asked.util_min || asked.util_max;
  switch (error) {
    case EPERM:
      return refused(error, why_not_permitted(asked, kernel));
    case EBUSY:
      return refused(error, why_not_admitted(asked, kernel));
    case EINVAL:
      return refused(error, why_invalid(asked, kernel));
    case EOPNOTSUPP:
    case E2BIG:
      return refused(error, has_clamps ? "this kernel has no utilization clamps "
                                         "(CONFIG_UCLAMP_TASK, Linux 5.3): remove uclamp_min and "
                                         "uclamp_max"
                                       : "this kernel is too old for it");
    case ESRCH:
      return refused(error, "the thread has ended");
    default:
      return refused(error, "the kernel gives no other reason");
  }
}

std::string why_affinity_refused(int error, const KernelView& kernel) {
  switch (error) {
    case EINVAL: {
      const auto group = kernel.group("cpuset");
      const auto allowed =
          group ? KernelView::line(group->folder / (group->is_unified ? "cpuset.cpus.effective"
                                                                      : "cpuset.effective_cpus"))
                : std::nullopt;
      const auto online = KernelView::line(kernel.path("/sys/devices/system/cpu/online"));
      return refused(error,
                     "none of these CPUs is online and allowed to this process: online are " +
                         online.value_or("unknown") + ", its cpuset allows " +
                         allowed.value_or("all of them"));
    }
    case EBUSY:
      return refused(error,
                     "the thread is SCHED_DEADLINE, which goes only with all CPUs of a cpuset: "
                     "remove the affinity, or let it have a cpuset of its own with `cpuset: "
                     "exclusive`");
    case ESRCH:
      return refused(error, "the thread has ended");
    default:
      return refused(error, "see `taskset -p` and the cpuset");
  }
}

std::string why_memory_lock_refused(int error, const KernelView& kernel) {
  const auto limit = kernel.limit("Max locked memory");
  const bool may_be_limit =
      (error == ENOMEM || error == EPERM || error == EAGAIN) && limit != kUnlimited;
  if (!may_be_limit || kernel.has_capability(kCapIpcLock)) {
    return refused(error, "the kernel gives no other reason");
  }
  return refused(
      error, fmt::format("RLIMIT_MEMLOCK is too small{} for what the process maps: raise `ulimit "
                         "-l`, or give it CAP_IPC_LOCK; lock_memory: on_fault counts as much",
                         limit ? fmt::format(" ({} kB)", *limit / 1024) : ""));
}

std::string why_no_thread(int error, const KernelView& kernel) {
  if (error != EAGAIN) return "the kernel gives no other reason";
  if (const auto group = kernel.group("pids")) {
    const auto most = KernelView::number(group->folder / "pids.max");
    const auto now = KernelView::number(group->folder / "pids.current");
    if (most && now && *now >= *most)
      return "the pids control group is full: raise " + (group->folder / "pids.max").string();
  }
  const auto limit = kernel.limit("Max processes");
  const auto threads = kernel.threads_of_user();
  if (limit && limit != kUnlimited && threads >= *limit) {
    return fmt::format("this user has {} threads, and RLIMIT_NPROC is {}: raise `ulimit -u`",
                       threads, *limit);
  }
  return fmt::format(
      "{}memory for its stack (RLIMIT_MEMLOCK, if memory is locked), or the "
      "creator is SCHED_DEADLINE without reset-on-fork",
      limit == kUnlimited ? ""
      : limit             ? fmt::format("RLIMIT_NPROC ({}), ", *limit)
                          : "RLIMIT_NPROC, ");
}

}  // namespace cie::scheduling
