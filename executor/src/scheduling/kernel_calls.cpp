#include <cie/scheduling/kernel_calls.hpp>

#include <cerrno>
#include <cstddef>
#include <memory>

#include <sched.h>

namespace cie::scheduling {
namespace {

struct FreeCpuSet {
  void operator()(cpu_set_t* set) const noexcept { CPU_FREE(set); }
};

}  // namespace

int KernelCalls::set_attributes(std::uint32_t tid, const SchedAttr& attributes) {
  return set_sched_attr(tid, attributes);
}

int KernelCalls::set_affinity(std::uint32_t tid, const std::vector<std::uint32_t>& cpus) {
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

std::optional<trace::SchedReadBack> KernelCalls::read_back(std::uint32_t tid) {
  return trace::read_back(tid);
}

std::optional<trace::SchedReadBack> KernelCalls::emit(trace::Thread& thread, SchedMoment moment,
                                                      int error) {
  return thread.emit_sched(moment, error);
}

}  // namespace cie::scheduling
