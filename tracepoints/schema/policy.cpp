#include <cie/tracepoints/policy.hpp>

#include <algorithm>
#include <array>
#include <utility>

namespace cie {
namespace {

constexpr std::array<std::pair<Policy, std::string_view>, 6> kPolicies{{
    {Policy::other, "SCHED_OTHER"},
    {Policy::batch, "SCHED_BATCH"},
    {Policy::idle, "SCHED_IDLE"},
    {Policy::fifo, "SCHED_FIFO"},
    {Policy::round_robin, "SCHED_RR"},
    {Policy::deadline, "SCHED_DEADLINE"},
}};

}  // namespace

std::string_view policy_name(Policy policy) noexcept {
  for (const auto& [value, name] : kPolicies) {
    if (value == policy) return name;
  }
  return {};
}

std::optional<Policy> policy_from_name(std::string_view name) noexcept {
  for (const auto& [value, known] : kPolicies) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<std::string> policy_names() {
  std::vector<std::string> names;
  names.reserve(kPolicies.size());
  for (const auto& [policy, name] : kPolicies)
    names.emplace_back(name);
  return names;
}

std::int32_t kernel_priority(Policy policy, std::int32_t nice, std::uint32_t priority) noexcept {
  switch (policy) {
    case Policy::fifo:
    case Policy::round_robin:
      return 99 - static_cast<std::int32_t>(std::min(priority, 99U));
    case Policy::deadline:
      return -1;
    case Policy::other:
    case Policy::batch:
    case Policy::idle:
      break;
  }
  return 120 + std::clamp(nice, -20, 19);
}

}  // namespace cie
