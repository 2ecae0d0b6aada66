// What a machine tells in files, /proc and /sys above all, of a process's rights and limits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie {

// A control group, as the files of one controller.
struct ControlGroup {
  std::filesystem::path mount;   // of the hierarchy
  std::filesystem::path folder;  // of the group, below it
  bool is_unified = false;       // version 2
};

// A limit that there is not: RLIM_INFINITY.
inline constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

// Reads anew at each question; thread-safe. Paths are as the machine names them. Answers are empty
// where the file does not tell.
class MachineFiles {
 public:
  // `root`: the folder that stands for "/", so that another machine's files, or a test's, can be
  // read in place of this one's.
  explicit MachineFiles(std::filesystem::path root = "/") : root_(std::move(root)) {}

  // Where a file of the machine lies.
  std::filesystem::path path(const std::filesystem::path& file) const;
  bool has(const std::filesystem::path& file) const;
  // Without its last line end.
  std::optional<std::string> text(const std::filesystem::path& file) const;
  // Of a file that holds nothing else.
  std::optional<std::int64_t> number(const std::filesystem::path& file) const;

  // `task` is a process's or thread's folder in /proc: "self", "thread-self", "self/task/TID".
  // What its `status` says under that name.
  std::optional<std::string> status(std::string_view name, std::string_view task = "self") const;
  // Whether the capability of that number (linux/capability.h) is effective.
  std::optional<bool> has_capability(unsigned number, std::string_view task = "self") const;
  // Where it stands for a controller.
  std::optional<ControlGroup> control_group(std::string_view controller,
                                            std::string_view task = "self") const;
  // This process's soft limit of that name in /proc/self/limits; kUnlimited if there is none.
  std::optional<std::uint64_t> limit(std::string_view name) const;

  // In rising order; CPU 0 where the file does not tell.
  std::vector<std::uint32_t> online_cpus() const;

 private:
  std::filesystem::path root_;
};

// The same of a file by its path on this machine.
std::optional<std::string> text_of(const std::filesystem::path& file);
std::optional<std::int64_t> number_of(const std::filesystem::path& file);

}  // namespace cie
