#include <cie/tracepoints/sched_attr.hpp>

#include <cerrno>
#include <cstdint>

#include <sys/syscall.h>
#include <unistd.h>

namespace cie {
namespace {

constexpr std::uint32_t kFirstVersion = 48;  // bytes of struct sched_attr without the clamps

}  // namespace

int set_sched_attr(std::uint32_t tid, SchedAttr attributes) noexcept {
  const bool has_clamps = (attributes.flags & (kSchedFlagUtilMin | kSchedFlagUtilMax)) != 0;
  attributes.size = has_clamps ? static_cast<std::uint32_t>(sizeof attributes) : kFirstVersion;
  return syscall(SYS_sched_setattr, static_cast<pid_t>(tid), &attributes, 0U) == 0 ? 0 : errno;
}

int get_sched_attr(std::uint32_t tid, SchedAttr& attributes) noexcept {
  attributes = {};
  return syscall(SYS_sched_getattr, static_cast<pid_t>(tid), &attributes, sizeof attributes, 0U) ==
                 0
             ? 0
             : errno;
}

}  // namespace cie
