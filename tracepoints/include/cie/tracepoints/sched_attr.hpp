// A thread's scheduling parameters as the kernel takes and reports them: sched_setattr and
// sched_getattr, which the C library of Debian 12 lacks.
#pragma once

#include <cstdint>

namespace cie {

// struct sched_attr of uapi/linux/sched/types.h. Its first published version ends before the
// utilization clamps; kernels before 5.3 know no more.
struct SchedAttr {
  std::uint32_t size = 0;    // filled in by the functions below
  std::uint32_t policy = 0;  // a number of cie::Policy
  std::uint64_t flags = 0;   // kSchedFlag…
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime = 0;  // SCHED_DEADLINE; the time slice under SCHED_OTHER since Linux 6.12
  std::uint64_t deadline = 0;
  std::uint64_t period = 0;
  std::uint32_t util_min = 0;  // of 1024; both 0 where the kernel has no utilization clamps
  std::uint32_t util_max = 0;
};
static_assert(sizeof(SchedAttr) == 56);

inline constexpr std::uint64_t kSchedFlagResetOnFork = 0x01;
inline constexpr std::uint64_t kSchedFlagUtilMin = 0x20;
inline constexpr std::uint64_t kSchedFlagUtilMax = 0x40;

// Both are of a thread of this process (0: the caller), get_sched_attr also of another one, may be called
// from any thread, and return 0 or an errno.
int set_sched_attr(std::uint32_t tid, SchedAttr attributes) noexcept;
int get_sched_attr(std::uint32_t tid, SchedAttr& attributes) noexcept;

}  // namespace cie
