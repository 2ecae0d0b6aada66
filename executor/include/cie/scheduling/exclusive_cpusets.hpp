// Cpusets of their own for SCHED_DEADLINE threads that may not use all CPUs.
#pragma once

#include <cie/scheduling/kernel_view.hpp>
#include <cie/scheduling/sched_request.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace cie::scheduling {

// The kernel takes SCHED_DEADLINE only with all CPUs of a scheduling domain, and an exclusive
// cpuset is one of its own. Entries that say `cpuset: exclusive` get one, below the control group
// in which their thread was: those that name the same CPUs share it. It takes these CPUs from
// nobody that runs already, but no other exclusive cpuset can have them, so nothing is made that
// was not asked for, and what the machine's owner decides (load balancing above it, partitions) is
// not touched: where it stands in the way, joining is refused with the remedy. Thread-safe.
class ExclusiveCpusets {
 public:
  explicit ExclusiveCpusets(const KernelView& kernel) : kernel_(kernel) {}
  ExclusiveCpusets(const ExclusiveCpusets&) = delete;
  ExclusiveCpusets& operator=(const ExclusiveCpusets&) = delete;
  // Sends threads that are still inside back to where they were, and removes the cpusets.
  ~ExclusiveCpusets();

  const KernelView& kernel() const noexcept { return kernel_; }

  // Moves a thread of this process into the cpuset of these CPUs.
  SchedRequest join(std::uint32_t tid, const std::vector<std::uint32_t>& cpus);
  // Back to where it was before, if it joined; else does nothing.
  void leave(std::uint32_t tid);

 private:
  struct Cpuset {
    ControlGroup parent;
    std::filesystem::path folder;
  };
  // Makes the cpuset; returns why it cannot, empty if it could.
  static std::string make(const Cpuset& cpuset, const std::string& cpus);
  static void remove(const Cpuset& cpuset) noexcept;
  bool leave_locked(std::uint32_t tid);  // true if it was in one of ours

  const KernelView& kernel_;
  std::mutex mutex_;
  std::map<std::string, Cpuset> cpusets_;  // by list of CPUs
};

}  // namespace cie::scheduling
