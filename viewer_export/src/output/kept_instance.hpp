// An instance as writers keep it until it is its turn.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/report.hpp>

#include "optional_numbers.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::viewer_export {

// Below 0 where events do not tell their thread: they lack the context vtid.
inline std::optional<std::int64_t> known_tid(std::int64_t tid) {
  return tid < 0 ? std::nullopt : std::optional(tid);
}

// Small, and trivially copyable: it is sorted, and spilled to disk.
struct KeptInstance {
  // What may be unknown.
  enum Number : std::uint8_t {
    release,
    wakeup,
    end,
    cpu_start,
    cpu_end,
    execution,
    preempted,
    blocked,
    waking,
    wake_delay,
    missed
  };

  std::int64_t start = 0;
  std::int64_t tid = 0;
  analysis::CallbackIndex callback{};
  analysis::ProcessIndex process{};
  std::uint64_t seq = 0;
  std::int64_t source_timestamp = 0;
  std::uint64_t writer_gid = 0;
  analysis::ReleaseSource release_source{};
  analysis::InstanceState state{};
  std::optional<CallbackStatus> status{};
  OptionalNumbers<Number, missed + 1> numbers{};
  // In tables of the writer that keeps it, which need not have them all.
  std::uint32_t name = 0;  // of the logical id
  std::uint32_t thread = 0;
  std::uint64_t index = 0;  // in order of arrival

  // All but what the writer's tables say.
  static KeptInstance of(const analysis::Instance& instance);

  std::optional<std::int64_t> number(Number which) const {
    return numbers.get<std::int64_t>(which);
  }
  // From an exactly known release to the end.
  std::optional<std::int64_t> response() const;
  // From the release to the start, or what that is at least: a source timestamp lies before the release.
  std::optional<std::int64_t> least_start_latency() const;
  // A response time, or what it is at least. Empty: its end is not known.
  std::optional<std::int64_t> least_response() const;
};

// Timers of ROS 2 whose calculated releases the analysis took back, all of them, when some rows had
// been told.
class TakenBackReleases {
 public:
  explicit TakenBackReleases(const analysis::Report& report);
  // The row as the report has it: where its release was taken back its start is the bound.
  KeptInstance corrected(KeptInstance row) const;

 private:
  std::vector<bool> has_releases_;  // by callback
};

}  // namespace cie::viewer_export
