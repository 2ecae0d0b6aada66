// What is known of each host's clocks as events come: how a time of one reads on another.
#pragma once

#include <cie/analysis/event.hpp>

#include "model/by_index.hpp"
#include "model/facts.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace cie::analysis {

class HostClocks {
 public:
  // By less two readings differ where nobody set a clock: the thread may wait between the two clocks.
  static constexpr Duration kLeastStep{100'000};

  explicit HostClocks(Model& model) : model_(model) {}

  // CLOCK_REALTIME - CLOCK_MONOTONIC, as a trace's metadata have it. 0: they do not tell.
  void apply(HostIndex host, const StreamBegin& event);
  // The same, as a process has just read it: as it began or was attached to, and every second.
  void apply(HostIndex host, const RunBegin& event);
  void apply(HostIndex host, const ClockSync& event);
  // What a message of ROS 2 shows of them: that CLOCK_REALTIME was not behind its source timestamp.
  void apply_shown(HostIndex host, const ClockSync& event);

  // What a process of the host read last. Empty: none did.
  const std::optional<std::int64_t>& synced(HostIndex host) const noexcept {
    const auto* offsets = offsets_.find(host);
    return offsets == nullptr ? kNoOffset : offsets->of_process;
  }
  // A process has read the clocks since: whether one was set before is known.
  bool were_read_since(HostIndex host, Timestamp time) const noexcept;
  // CLOCK_REALTIME may have been set between its showing `realtime_ns` and `until`, as far as processes
  // have read it: what one offset makes of it is no bound then.
  bool may_be_set_between(HostIndex host, std::int64_t realtime_ns, Timestamp until) const noexcept;
  // When the host's own clock, CLOCK_MONOTONIC, showed a time that CLOCK_REALTIME showed somewhere.
  // Empty: nothing relates the host's two clocks.
  std::optional<Timestamp> local(HostIndex host, std::int64_t realtime_ns) const noexcept;
  // What its clock showed when that of another host showed `time`, as both hosts' CLOCK_REALTIME relate
  // them. Empty: nothing relates one of them to that.
  std::optional<Timestamp> local(HostIndex host, HostIndex other, Timestamp time) const noexcept;
  // A message took so long from one host to another, as their clocks show.
  void note_message(HostIndex from, HostIndex to, Duration shown);

 private:
  // CLOCK_REALTIME was set then.
  struct Step {
    Timestamp after;
    Timestamp until;
    std::int64_t larger_offset = 0;  // of the two
  };
  struct Offsets {
    std::optional<std::int64_t> of_metadata;
    std::optional<std::int64_t> of_process;
    std::optional<std::int64_t> last_read;  // not merely shown
    Timestamp read_at;
    std::deque<Step> steps;  // the latest kMostSteps
  };
  static constexpr std::size_t kMostSteps = 64;
  static constexpr std::optional<std::int64_t> kNoOffset{};
  // CLOCK_REALTIME - CLOCK_MONOTONIC, by the latest that is known of it.
  const std::optional<std::int64_t>& latest(HostIndex host) const noexcept;
  static bool is_step(std::int64_t one_offset, std::int64_t other_offset) noexcept;
  void sync(HostIndex host, std::int64_t monotonic_ns, std::int64_t realtime_ns);

  Model& model_;
  ByIndex<HostIndex, Offsets> offsets_;
  HostClockFacts* last_ = nullptr;  // most often a message takes the way of the one before it
  HostPair last_pair_{};
};

}  // namespace cie::analysis
