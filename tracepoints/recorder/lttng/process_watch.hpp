// Which processes are being recorded: whoever emits `run_begin`, at its start or because recording
// began, or `ros2:rcl_init`, however short it lives.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "lttng/event_watch.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <sys/types.h>

namespace cie::record {

class ProcessWatch {
 public:
  // `name` is one that no other session has. With `is_ros2` processes of ROS 2 count. `daemon` is
  // the session daemon's pid; 0: unknown. Throws RecordError when LTTng refuses.
  ProcessWatch(const std::string& name, bool is_ros2, pid_t daemon);

  // Takes what came since the last call; false if nothing did. Never waits.
  bool poll();
  // The same of all that was emitted before this call: waits, seconds at most, until the daemon has
  // passed it on. It has missed something if that takes longer.
  bool catch_up();
  // Before the session daemon ends. What was told stays known.
  void stop() noexcept;
  // LTTng dropped some of what it had to tell: not all processes are known.
  bool has_missed() const noexcept { return has_missed_; }

  // Processes whose `run_begin` (`rcl_init`) was emitted in [from, to) of CLOCK_MONOTONIC, by pid. What was told
  // so far is known.
  std::vector<RecordedProcess> begun(std::int64_t from_ns, std::int64_t to_ns) const;
  // Those are not asked for again.
  void forget(std::int64_t before_ns);
  // How many processes were told of, by pid, those that were forgotten too.
  std::size_t count() const noexcept { return pids_.size(); }

 private:
  void note_losses() noexcept;

  struct Begin {
    std::optional<std::int64_t> time_ns;  // empty: since it was asked before
    RecordedProcess process;
  };
  std::optional<EventWatch> begins_;       // empty: it is over
  std::optional<EventWatch> ros2_begins_;  // likewise, or nobody asked
  pid_t daemon_;
  bool has_missed_ = false;
  std::vector<Begin> known_;
  std::set<std::int64_t> pids_;
};

// Both lists, each process once, by pid.
std::vector<RecordedProcess> merged(std::vector<RecordedProcess> processes,
                                    const std::vector<RecordedProcess>& more);

}  // namespace cie::record
