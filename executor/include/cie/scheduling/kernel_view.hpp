// What the kernel tells in /proc and /sys of the limits that scheduling requests meet.
#pragma once

#include <cie/tracepoints/machine_files.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace cie::scheduling {

// Reads anew at each question; thread-safe. Answers are empty where the kernel has no such thing.
class KernelView {
 public:
  // Tests put a tree of their own in place of "/".
  explicit KernelView(std::filesystem::path root = "/") : files_(std::move(root)) {}

  // A file below the root; its first line, or its number.
  std::filesystem::path path(std::string_view absolute) const { return files_.path(absolute); }
  static std::optional<std::string> line(const std::filesystem::path& file);
  static std::optional<std::int64_t> number(const std::filesystem::path& file);
  std::optional<std::int64_t> kernel_setting(std::string_view name) const;  // /proc/sys/kernel/…

  // Whether the calling thread has it. Unknown counts as present: no message names a wrong remedy.
  bool has_capability(unsigned bit) const;
  // Whether its capabilities count for the whole machine.
  bool is_in_first_user_namespace() const;
  std::optional<std::string> allowed_cpus() const;  // "0-3,7"
  // A soft limit by its name in /proc/self/limits; kUnlimited if there is none.
  std::optional<std::uint64_t> limit(std::string_view name) const { return files_.limit(name); }
  // How many threads the processes of this one's real user have, as far as /proc shows them here.
  std::uint64_t threads_of_user() const;
  // Where a thread of this process (0: the caller) stands for a controller, by paths below the root.
  std::optional<ControlGroup> group(std::string_view controller, std::uint32_t tid = 0) const;

 private:
  MachineFiles files_;
};

inline constexpr unsigned kCapSysNice = 23;
inline constexpr unsigned kCapIpcLock = 14;

}  // namespace cie::scheduling
