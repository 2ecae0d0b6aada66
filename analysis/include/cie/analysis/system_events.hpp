// Events of the kernel and of tracers, whatever thread was running.
#pragma once

#include <cie/analysis/event_head.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace cie::analysis {

// What the kernel calls a thread: a copy, for it has no more than TASK_COMM_LEN bytes (linux/sched.h). Of a
// longer text, which no kernel wrote, these are the first.
class TaskName {
 public:
  TaskName() noexcept = default;
  // NOLINTNEXTLINE(google-explicit-constructor): whoever makes events gives a text
  TaskName(std::string_view name) noexcept { name.copy(characters_.data(), characters_.size()); }
  // NOLINTNEXTLINE(google-explicit-constructor): likewise
  TaskName(const char* name) noexcept : TaskName(std::string_view(name)) {}
  // NOLINTNEXTLINE(google-explicit-constructor): whoever reads them gets one
  operator std::string_view() const noexcept {
    const std::string_view all(characters_.data(), characters_.size());
    return {all.data(), std::min(all.find('\0'), all.size())};
  }

 private:
  std::array<char, 16> characters_{};
};

// Priorities are normalised: 99 - rt for FIFO and RR, 120 + nice, -1 for DEADLINE.
struct SchedSwitch {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_switch";
  TaskName prev_comm;
  std::int64_t prev_tid = 0;
  std::int32_t prev_prio = 0;
  std::int64_t prev_state = 0;  // as the kernel wrote it
  TaskName next_comm;
  std::int64_t next_tid = 0;
  std::int32_t next_prio = 0;
};
struct SchedWaking {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_waking";
  std::int64_t tid = 0;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};
struct SchedWakeup {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_wakeup";
  std::int64_t tid = 0;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};
struct SchedProcessFork {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_process_fork";
  std::int64_t parent_tid = 0;
  std::int64_t child_tid = 0;
  TaskName child_comm;
};
struct SchedProcessExit {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_process_exit";
  std::int64_t tid = 0;
};
// A thread executes another program in place of its process's, whose other threads end.
struct SchedProcessExec {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_process_exec";
  std::int64_t tid = 0;  // from here on: its process's pid
  std::int64_t old_tid = 0;
};
struct SchedMigrateTask {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_migrate_task";
  std::int64_t tid = 0;
  std::int32_t orig_cpu = 0;
  std::int32_t dest_cpu = 0;
};
struct SchedPiSetprio {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_pi_setprio";
  std::int64_t tid = 0;
  std::int32_t old_prio = 0;
  std::int32_t new_prio = 0;
};

// LTTng: what a process calls itself, told when a session starts.
struct ProcessName {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "lttng_ust_statedump:procname";
  std::string_view name;
};

}  // namespace cie::analysis
