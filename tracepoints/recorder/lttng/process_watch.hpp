// Which processes are being recorded: whoever emits `run_begin`, at its start or because recording
// began, however short it lives.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "lttng/event_watch.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

class ProcessWatch {
 public:
  // `name` is one that no other session has. Throws RecordError when LTTng refuses.
  explicit ProcessWatch(const std::string& name);

  // Takes what came since the last call; false if nothing did. Never waits.
  bool poll();
  // Before the session daemon ends. What was told stays known.
  void stop() noexcept;
  // LTTng dropped some of what it had to tell: not all processes are known.
  bool has_missed() const noexcept { return has_missed_; }

  // Processes whose `run_begin` was emitted in [from, to) of CLOCK_MONOTONIC, by pid. What was told
  // so far is known: what comes last may take some milliseconds.
  std::vector<RecordedProcess> begun(std::int64_t from_ns, std::int64_t to_ns) const;
  // Those are not asked for again.
  void forget(std::int64_t before_ns);

 private:
  struct Begin {
    std::int64_t time_ns = 0;
    RecordedProcess process;
  };
  std::optional<EventWatch> begins_;  // empty: it is over
  bool has_missed_ = false;
  std::vector<Begin> known_;
};

// Both lists, each process once, by pid.
std::vector<RecordedProcess> merged(std::vector<RecordedProcess> processes,
                                    const std::vector<RecordedProcess>& more);

}  // namespace cie::record
