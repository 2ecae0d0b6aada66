// Which track a slice goes on. A thread has its own track for what nests, and child tracks for what
// may overlap: slices of one track must nest, or Perfetto ends the wrong one.
#pragma once

#include <cie/analysis/report.hpp>

#include "perfetto_packets.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace cie::viewer_export::perfetto {

class Tracks {
 public:
  using Thread = std::pair<std::int64_t, std::int64_t>;  // pid, tid

  void see(std::int64_t pid, std::int64_t tid) { threads_[{pid, tid}]; }
  // Describes all processes and threads seen, with the report's names, in order of pid and tid.
  void describe(PacketBuffer& packets, const analysis::Report& report, std::int64_t time);

  std::uint64_t thread_track(std::int64_t pid, std::int64_t tid) {
    return threads_[{pid, tid}].uuid;
  }
  // The track for an instance. Ask in order of start, outer before inner; `end` empty: open.
  std::optional<std::uint64_t> instance_track(PacketBuffer& packets, const Thread& thread,
                                              std::int64_t start, std::optional<std::int64_t> end);
  // A track for a wait that ends at `end`. Ask in order of end. Empty: too many overlap.
  std::optional<std::uint64_t> wait_track(PacketBuffer& packets, const Thread& thread,
                                          std::int64_t begin, std::int64_t end);

 private:
  struct Lane {
    std::uint64_t uuid = 0;
    std::int64_t end = 0;  // of its last slice
  };
  struct ThreadTracks {
    std::uint64_t uuid = 0;
    std::vector<std::int64_t> open_ends;  // of the slices around the next one, outermost first
    std::vector<Lane> overlaps;
    std::vector<Lane> waits;
  };

  std::optional<std::uint64_t> lane(PacketBuffer& packets, std::vector<Lane>& lanes,
                                    std::uint64_t parent, std::string_view name, std::int64_t begin,
                                    std::int64_t end);

  std::map<Thread, ThreadTracks> threads_;
  std::uint64_t last_uuid_ = 0;
};

}  // namespace cie::viewer_export::perfetto
