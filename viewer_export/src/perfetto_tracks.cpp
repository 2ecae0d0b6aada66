#include "perfetto_tracks.hpp"

#include "utf8.hpp"

#include <limits>
#include <string>

#include <fmt/format.h>

namespace cie::viewer_export::perfetto {
namespace {

// Overlaps beyond this are no longer readable, and a damaged trace could make millions.
constexpr std::size_t kMostLanes = 64;

bool is_kernel_id(std::int64_t id) {
  return id > 0 && id <= std::numeric_limits<std::int32_t>::max();
}

}  // namespace

void Tracks::describe(PacketBuffer& packets, const analysis::Report& report, std::int64_t time) {
  std::map<Thread, std::string> names;
  for (const auto& thread : report.threads) {
    names[{thread.pid, thread.tid}] = valid_utf8(thread.name);
    see(thread.pid, thread.tid);
  }
  for (const auto& process : report.processes) {
    if (is_kernel_id(process.pid)) {
      packets.process(time, ++last_uuid_, process.pid, valid_utf8(process.name));
    }
  }
  for (auto& [thread, tracks] : threads_) {
    const auto [pid, tid] = thread;
    tracks.uuid = ++last_uuid_;
    if (is_kernel_id(pid) && is_kernel_id(tid)) {
      packets.thread(time, tracks.uuid, pid, tid, names[thread]);
    } else {
      packets.track(tracks.uuid, 0, fmt::format("pid {} tid {} {}", pid, tid, names[thread]));
    }
  }
}

std::optional<std::uint64_t> Tracks::instance_track(PacketBuffer& packets, const Thread& thread,
                                                    std::int64_t start,
                                                    std::optional<std::int64_t> end) {
  constexpr auto kNever = std::numeric_limits<std::int64_t>::max();
  auto& tracks = threads_[thread];
  auto& around = tracks.open_ends;
  while (!around.empty() && around.back() <= start) {
    around.pop_back();
  }
  const auto own_end = end.value_or(kNever);
  if (!around.empty() && around.back() < own_end) {
    return lane(packets, tracks.overlaps, tracks.uuid, "overlapping instances", start, own_end);
  }
  around.push_back(own_end);
  return tracks.uuid;
}

std::optional<std::uint64_t> Tracks::wait_track(PacketBuffer& packets, const Thread& thread,
                                                std::int64_t begin, std::int64_t end) {
  auto& tracks = threads_[thread];
  return lane(packets, tracks.waits, tracks.uuid, "release to start", begin, end);
}

std::optional<std::uint64_t> Tracks::lane(PacketBuffer& packets, std::vector<Lane>& lanes,
                                          std::uint64_t parent, std::string_view name,
                                          std::int64_t begin, std::int64_t end) {
  for (auto& lane : lanes) {
    if (lane.end <= begin) {
      lane.end = end;
      return lane.uuid;
    }
  }
  if (lanes.size() >= kMostLanes) {
    return std::nullopt;
  }
  lanes.push_back({++last_uuid_, end});
  packets.track(last_uuid_, parent, name);
  return last_uuid_;
}

}  // namespace cie::viewer_export::perfetto
