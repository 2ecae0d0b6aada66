// Counts what threads of other processes cost the kernel, by the events that `perf stat` counts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <sys/types.h>

namespace bench {

struct KernelCounts {
  std::optional<std::uint64_t> system_calls;      // raw_syscalls:sys_enter; needs tracefs and root
  std::optional<std::uint64_t> context_switches;  // of all threads together
  std::uint64_t cpu_ns = 0;                       // CPU time of all threads
};

// Counts from construction to stop(), over all threads that the processes have at construction.
class KernelCounter {
 public:
  explicit KernelCounter(const std::vector<pid_t>& processes);
  KernelCounter(const KernelCounter&) = delete;
  KernelCounter& operator=(const KernelCounter&) = delete;
  ~KernelCounter();
  KernelCounts stop();

 private:
  std::vector<int> system_calls_;  // file descriptors, one per thread
  std::vector<int> context_switches_;
  std::vector<int> cpu_time_;
};

}  // namespace bench
