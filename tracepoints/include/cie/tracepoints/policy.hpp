// Linux's scheduling policies, and what each of them has.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie {

// Linux scheduling policies by their kernel numbers (uapi/linux/sched.h).
enum class Policy : std::int32_t {
  other = 0,
  fifo = 1,
  round_robin = 2,
  batch = 3,
  idle = 5,
  deadline = 6
};

// "SCHED_FIFO" and the like; empty for an unknown number.
std::string_view policy_name(Policy policy) noexcept;
// Accepts SCHED_OTHER, SCHED_BATCH, SCHED_IDLE, SCHED_FIFO, SCHED_RR, SCHED_DEADLINE.
std::optional<Policy> policy_from_name(std::string_view name) noexcept;
// All that it accepts.
std::vector<std::string> policy_names();

// SCHED_IDLE keeps a nice value, of which the kernel makes nothing.
constexpr bool has_nice(Policy policy) noexcept {
  return policy == Policy::other || policy == Policy::batch;
}
constexpr bool has_priority(Policy policy) noexcept {
  return policy == Policy::fifo || policy == Policy::round_robin;
}
constexpr bool is_real_time(Policy policy) noexcept {
  return has_priority(policy) || policy == Policy::deadline;
}

// SCHED_DEADLINE: Linux's defaults of kernel.sched_deadline_period_min_us and _max_us.
inline constexpr std::int64_t kLeastPeriodUs = 100;
inline constexpr std::int64_t kMostPeriodUs = 4'194'304;

// The priority that the kernel's events tell (sched_switch): 99 - priority, 120 + nice, and -1 of
// SCHED_DEADLINE. One that is not known has a nice value, as SCHED_EXT (7) does.
std::int32_t kernel_priority(Policy policy, std::int32_t nice, std::uint32_t priority) noexcept;

}  // namespace cie
