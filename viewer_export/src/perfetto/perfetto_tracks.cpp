#include "perfetto_tracks.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/tracepoints/utf8.hpp>

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

void Tracks::describe(PacketBuffer& packets, const analysis::Report& report,
                      const ThreadTable& threads, const FileBegin& begin) {
  for (const auto& thread : threads.all())
    by_number_.push_back(&threads_[thread]);
  std::map<ThreadKey, std::string> names;
  const analysis::ReportRows rows(report);
  for (const auto& thread : report.threads) {
    const auto key = thread_of(thread, rows);
    names[key] = valid_utf8(thread.name);
    threads_[key];
  }
  for (const auto& process : report.processes) {
    if (is_kernel_id(process.pid)) {
      auto& uuid = processes_[{process.host_index, process.pid}];
      uuid = new_uuid();
      packets.set_machine(process.host_index);
      packets.process(begin.on(process.host_index), uuid, process.pid, valid_utf8(process.name));
    }
  }
  for (auto& [thread, tracks] : threads_) {
    tracks.uuid = new_uuid();
    packets.set_machine(thread.host);
    if (is_kernel_id(thread.pid) && is_kernel_id(thread.tid)) {
      packets.thread(begin.on(thread.host), tracks.uuid, thread.pid, thread.tid, names[thread]);
    } else {
      packets.track(tracks.uuid, 0, fmt::format("{} {}", ids_of(thread), names[thread]));
    }
  }
}

std::uint64_t Tracks::process_track(analysis::HostIndex host, std::int64_t pid) const {
  const auto found = processes_.find({host, pid});
  return found == processes_.end() ? 0 : found->second;
}

void Tracks::change_process(PacketBuffer& packets, std::uint32_t thread,
                            analysis::ProcessIndex process, std::int64_t time) {
  auto& tracks = of(thread);
  for (auto left = tracks.open.change_process(process); left > 0; --left)
    packets.slice_end(time, tracks.uuid);
}

std::optional<std::uint64_t> Tracks::instance_track(PacketBuffer& packets, std::uint32_t thread,
                                                    std::int64_t start,
                                                    std::optional<std::int64_t> end) {
  auto& tracks = of(thread);
  if (tracks.open.enter(start, end, {})) {
    return tracks.uuid;
  }
  constexpr auto kNever = std::numeric_limits<std::int64_t>::max();
  return lane(packets, tracks.overlaps, tracks.uuid, "overlapping instances", start,
              end.value_or(kNever));
}

std::optional<std::uint64_t> Tracks::wait_track(PacketBuffer& packets, std::uint32_t thread,
                                                std::string_view name, std::int64_t begin,
                                                std::int64_t end) {
  auto& tracks = of(thread);
  return lane(packets, tracks.waits[name], tracks.uuid, name, begin, end);
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
  lanes.push_back({new_uuid(), end});
  packets.track(lanes.back().uuid, parent, name);
  return lanes.back().uuid;
}

}  // namespace cie::viewer_export::perfetto
