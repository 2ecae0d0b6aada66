// Which track a slice goes on. A thread has its own track for what nests, and child tracks for what
// may overlap: slices of one track must nest, or Perfetto ends the wrong one.
#pragma once

#include <cie/analysis/report.hpp>

#include "output/nesting.hpp"
#include "perfetto_packets.hpp"
#include "timelines/common_clock.hpp"
#include "timelines/thread_table.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace cie::viewer_export::perfetto {

// When the file begins, for what has no time of its own. Borrowed.
struct FileBegin {
  const CommonClock& clock;
  std::int64_t begin = 0;  // by it
  std::int64_t on(analysis::HostIndex host) const noexcept { return clock.own(host, begin); }
};

class Tracks {
 public:
  // Describes all processes and threads, those of the table and of the report, with the report's
  // names, in order of host, pid, tid. Below, a thread is its number in that table.
  void describe(PacketBuffer& packets, const analysis::Report& report, const ThreadTable& threads,
                const FileBegin& begin);

  std::uint64_t thread_track(std::uint32_t thread) const { return of(thread).uuid; }
  // 0: the process has none.
  std::uint64_t process_track(analysis::HostIndex host, std::int64_t pid) const;
  std::uint64_t new_uuid() noexcept { return ++last_uuid_; }
  // What follows on the thread at `time` is of that process: what another one, whose ids it has,
  // left open ends.
  void change_process(PacketBuffer& packets, std::uint32_t thread, analysis::ProcessIndex process,
                      std::int64_t time);
  // The track for an instance. Ask in order of start, outer before inner; `end` empty: open.
  std::optional<std::uint64_t> instance_track(PacketBuffer& packets, std::uint32_t thread,
                                              std::int64_t start, std::optional<std::int64_t> end);
  // A track for a wait that ends at `end`, with others of that name, which outlives this. Ask in
  // order of end. Empty: too many overlap.
  std::optional<std::uint64_t> wait_track(PacketBuffer& packets, std::uint32_t thread,
                                          std::string_view name, std::int64_t begin,
                                          std::int64_t end);

 private:
  struct Lane {
    std::uint64_t uuid = 0;
    std::int64_t end = 0;  // of its last slice
  };
  struct ThreadTracks {
    std::uint64_t uuid = 0;
    Nesting<std::monostate> open;
    std::vector<Lane> overlaps;
    std::map<std::string_view, std::vector<Lane>> waits;  // by name
  };

  ThreadTracks& of(std::uint32_t thread) const { return *by_number_.at(thread); }
  std::optional<std::uint64_t> lane(PacketBuffer& packets, std::vector<Lane>& lanes,
                                    std::uint64_t parent, std::string_view name, std::int64_t begin,
                                    std::int64_t end);

  std::map<std::pair<analysis::HostIndex, std::int64_t>, std::uint64_t> processes_;  // host, pid
  std::map<ThreadKey, ThreadTracks> threads_;
  std::vector<ThreadTracks*> by_number_;
  std::uint64_t last_uuid_ = 0;
};

}  // namespace cie::viewer_export::perfetto
