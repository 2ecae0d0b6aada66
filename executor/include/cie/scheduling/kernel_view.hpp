// What the kernel tells in /proc and /sys of the limits that scheduling requests meet.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace cie::scheduling {

// A control group, as the files of one controller.
struct ControlGroup {
  std::filesystem::path mount;   // of the hierarchy
  std::filesystem::path folder;  // of the group, below it
  bool is_unified = false;       // version 2
};

// Reads anew at each question; thread-safe. Answers are empty where the kernel has no such thing.
class KernelView {
 public:
  // Tests put a tree of their own in place of "/".
  explicit KernelView(std::filesystem::path root = "/") : root_(std::move(root)) {}

  // A file below the root; its first line, or its first number.
  std::filesystem::path path(std::string_view absolute) const;
  static std::optional<std::string> line(const std::filesystem::path& file);
  static std::optional<std::int64_t> number(const std::filesystem::path& file);
  std::optional<std::int64_t> kernel_setting(std::string_view name) const;  // /proc/sys/kernel/…

  // Whether the calling thread has it. Unknown counts as present: no message names a wrong remedy.
  bool has_capability(unsigned bit) const;
  // Whether its capabilities count for the whole machine.
  bool is_in_first_user_namespace() const;
  std::optional<std::string> allowed_cpus() const;  // "0-3,7"
  // A soft limit by its name in /proc/self/limits; the largest number if there is none.
  std::optional<std::uint64_t> limit(std::string_view name) const;
  // Where a thread of this process (0: the caller) stands for a controller.
  std::optional<ControlGroup> group(std::string_view controller, std::uint32_t tid = 0) const;

 private:
  std::optional<std::string> status_field(std::string_view name) const;

  std::filesystem::path root_;
};

inline constexpr unsigned kCapSysNice = 23;
inline constexpr unsigned kCapIpcLock = 14;

}  // namespace cie::scheduling
