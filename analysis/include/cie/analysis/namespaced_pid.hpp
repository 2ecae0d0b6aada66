// Pids of one host that several pid namespaces give, told apart in one number.
#pragma once

#include <cstdint>

namespace cie::analysis {

// Linux gives lower ones.
inline constexpr std::int64_t kPidsOfNamespace = std::int64_t{1} << 22U;
// As many as fit in the 32 bits of a ContextNumber.
inline constexpr std::uint32_t kMostNamespaces = 511;

// In the namespace with that number, which is at most kMostNamespaces; those in 0 are as they are.
constexpr std::int64_t pid_in_namespace(std::uint32_t number, std::int64_t pid) noexcept {
  const bool is_pid = pid >= 0 && pid < kPidsOfNamespace;
  return number == 0 || !is_pid ? pid : -(number * kPidsOfNamespace + pid);
}

// As the process itself knows it.
constexpr std::int64_t plain_pid(std::int64_t pid) noexcept {
  return pid > -kPidsOfNamespace ? pid : -pid % kPidsOfNamespace;
}

}  // namespace cie::analysis
