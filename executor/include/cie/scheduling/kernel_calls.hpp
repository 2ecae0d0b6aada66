// What configuring a thread asks of the kernel.
#pragma once

#include <cie/tracepoints/sched_attr.hpp>
#include <cie/tracepoints/trace.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::scheduling {

// The kernel that the process runs on; tests derive one that they describe. Each call is of a thread
// of this process (0: the caller), on any thread.
class KernelCalls {
 public:
  KernelCalls() = default;
  KernelCalls(const KernelCalls&) = delete;
  KernelCalls& operator=(const KernelCalls&) = delete;
  virtual ~KernelCalls() = default;

  // Return 0 or an errno. CPUs ascend.
  virtual int set_attributes(std::uint32_t tid, const SchedAttr& attributes);
  virtual int set_affinity(std::uint32_t tid, const std::vector<std::uint32_t>& cpus);
  // Empty when the thread is gone.
  virtual std::optional<trace::SchedReadBack> read_back(std::uint32_t tid);
  // Likewise, and emits what it read.
  virtual std::optional<trace::SchedReadBack> emit(trace::Thread& thread, SchedMoment moment,
                                                   int error);
};

}  // namespace cie::scheduling
