// Reads a thread's scheduling parameters back from the kernel.
#include <cie/tracepoints/policy.hpp>
#include <cie/tracepoints/sched_attr.hpp>
#include <cie/tracepoints/trace.hpp>

#include "base/machine.hpp"
#include "state.hpp"

#include <cerrno>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace cie::trace {
namespace {

// glibc 2.36 does not define SCHED_DEADLINE.
constexpr auto kDeadlinePolicy = static_cast<std::uint32_t>(Policy::deadline);

// The kernel refuses a mask shorter than its own, so it grows until it fits.
std::optional<std::vector<std::uint32_t>> read_affinity(pid_t tid) {
  constexpr std::size_t kBits = 8 * sizeof(unsigned long);
  for (std::size_t words = 16; words <= 16384; words *= 2) {
    std::vector<unsigned long> mask(words);
    const long bytes =
        syscall(SYS_sched_getaffinity, tid, words * sizeof(unsigned long), mask.data());
    if (bytes < 0 && errno == EINVAL) {
      continue;
    }
    if (bytes < 0) {
      return std::nullopt;
    }
    std::vector<std::uint32_t> cpus;
    for (std::size_t bit = 0; bit < static_cast<std::size_t>(bytes) * 8; ++bit) {
      if ((mask[bit / kBits] >> (bit % kBits)) & 1U) {
        cpus.push_back(static_cast<std::uint32_t>(bit));
      }
    }
    return cpus;
  }
  return std::nullopt;
}

// The kernel answers for whoever has the tid, which may be another process's thread by now.
bool is_of_this_process(std::uint32_t tid) {
  return tid == 0 || syscall(SYS_tgkill, ::getpid(), static_cast<pid_t>(tid), 0) == 0;
}

}  // namespace

std::optional<SchedReadBack> read_back(std::uint32_t tid) {
  SchedAttr attr;
  if (get_sched_attr(tid, attr) != 0) {
    return std::nullopt;
  }
  std::optional<std::vector<std::uint32_t>> cpus = read_affinity(static_cast<pid_t>(tid));
  if (!cpus || !is_of_this_process(tid)) {  // asked last: no other process gives a tid back
    return std::nullopt;
  }
  // For SCHED_OTHER the kernel reports the time slice there.
  const bool is_deadline = attr.policy == kDeadlinePolicy;
  return SchedReadBack{
      .policy = static_cast<std::int32_t>(attr.policy & ~std::uint32_t{SCHED_RESET_ON_FORK}),
      .flags = attr.flags,
      .nice = attr.nice,
      .priority = attr.priority,
      .runtime_ns = is_deadline ? attr.runtime : 0,
      .deadline_ns = is_deadline ? attr.deadline : 0,
      .period_ns = is_deadline ? attr.period : 0,
      .cpus = std::move(*cpus),
      .slice_ns = attr.policy == SCHED_OTHER ? attr.runtime : 0,
      .util_min = attr.util_min,
      .util_max = attr.util_max};
}

std::optional<std::uint64_t> created_ticks(std::uint32_t tid) {
  constexpr int kStartTime = 22;  // of proc(5)
  return stat_field("self/task/" + std::to_string(tid), kStartTime);
}

std::optional<SchedReadBack> read_back(const ThreadState& thread) {
  auto parameters = read_back(thread.tid);
  if (!parameters) return parameters;
  // Asked last, as above: whoever has the tid now had it before.
  const auto now = thread.created_ticks ? created_ticks(thread.tid) : std::nullopt;
  if (now && now != thread.created_ticks) parameters.reset();
  return parameters;
}

}  // namespace cie::trace
