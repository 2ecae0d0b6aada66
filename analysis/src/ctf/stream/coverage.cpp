#include "coverage.hpp"

#include <algorithm>
#include <cstddef>
#include <set>

namespace cie::analysis::ctf {

bool PacketTimes::has_events() const {
  for (const auto& file : files_) {
    PacketScanner scanner(file.file, file.trace->plan(), PacketScanner::kHeaderPiece);
    while (const auto packet = scanner.next_header()) {
      if (scanner.has_events(*packet)) return true;
    }
  }
  return false;
}

std::optional<TimeWindow> PacketTimes::times(Timestamp enough) const {
  std::optional<TimeWindow> covered;
  for (const auto& file : files_) {
    PacketScanner scanner(file.file, file.trace->plan(), PacketScanner::kHeaderPiece);
    while (const auto packet = scanner.next_header()) {
      if (!packet->stream->has_packet_times || !packet->begin || !packet->end) return std::nullopt;
      // A packet that was open when its writer died ends with its last event.
      const auto end = *packet->end < *packet->begin ? scanner.last_clock(*packet) : packet->end;
      const auto& clock = packet->stream->clock;
      const auto begin = clock.time_of(*packet->begin);
      if (!covered) covered = {.from = begin, .to = begin};
      covered->to = std::max(covered->to, clock.time_of(end.value_or(*packet->begin)));
      if (covered->to >= enough) return covered;
    }
  }
  return covered;
}

// Intervals that have a time in common pairwise have one all together (Helly), and it begins where
// one of them does.
LeftOut left_out(std::span<const TimeWindow> streams) {
  std::vector<TimeWindow> by_begin(streams.begin(), streams.end());
  std::ranges::sort(by_begin, {}, &TimeWindow::from);
  std::multiset<Timestamp> ends;  // of those that have begun and not ended
  std::size_t most = 0;
  TimeWindow common{};
  for (std::size_t i = 0; i < by_begin.size(); ++i) {
    const auto begin = by_begin[i].from;
    ends.insert(by_begin[i].to);
    ends.erase(ends.begin(), ends.lower_bound(begin));
    const TimeWindow here{.from = begin, .to = ends.empty() ? begin : *ends.begin()};
    const bool is_longer = here.to - here.from > common.to - common.from;
    if (ends.size() < most || (ends.size() == most && !is_longer)) continue;
    most = ends.size();
    common = here;
  }
  LeftOut result{.streams = {}, .common = common};
  for (const auto& stream : streams)
    result.streams.push_back(stream.from > common.from || stream.to < common.from);
  return result;
}

}  // namespace cie::analysis::ctf
