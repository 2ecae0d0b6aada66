#include "ctf/stream_check.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>

#include <sys/resource.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

bool is_stream(const fs::path& file) {
  const fs::path parent = file.parent_path();
  return file.filename() != "metadata" && parent.filename() != "index" &&
         fs::exists(parent / "metadata");
}

std::optional<PacketHeader> next_header(std::ifstream& stream, std::uint64_t position,
                                        std::uint64_t size) {
  std::array<char, sizeof(PacketHeader)> bytes{};
  stream.seekg(static_cast<std::streamoff>(position));
  if (!stream.read(bytes.data(), bytes.size())) return std::nullopt;
  return packet_header(std::bit_cast<std::array<std::uint8_t, sizeof(PacketHeader)>>(bytes),
                       size - position);
}

StreamSummary check_stream(const fs::path& file) {
  const std::uint64_t size = fs::file_size(file);
  StreamSummary summary{.file = file, .size = size};
  std::ifstream stream(file, std::ios::binary);
  std::uint64_t position = 0;
  std::uint64_t expected = 0;
  while (position < size) {
    const auto packet = next_header(stream, position, size);
    if (!packet) {
      summary.is_damaged = true;
      break;
    }
    summary.lost_packets += packet->number > expected ? packet->number - expected : 0;
    expected = packet->number + 1;
    summary.next_packet = expected;
    if (summary.packets == 0) {
      summary.begin = packet->begin;
    }
    summary.end = packet->end;
    summary.discarded_events = packet->discarded_events;
    summary.content_bytes += packet->content_bits / 8;
    ++summary.packets;
    summary.largest_packet = std::max(summary.largest_packet, packet->packet_bits / 8);
    position += packet->packet_bits / 8;
  }
  return summary;
}

}  // namespace

std::vector<StreamSummary> check_streams(const fs::path& directory) {
  std::vector<StreamSummary> summaries;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file() && is_stream(entry.path())) {
      summaries.push_back(check_stream(entry.path()));
    }
  }
  std::ranges::sort(summaries, {}, &StreamSummary::file);
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    mark_cut_by_limit(summaries, limit.rlim_cur);
  return summaries;
}

void mark_cut_by_limit(std::vector<StreamSummary>& streams, std::uint64_t limit) {
  std::uint64_t latest = 0;
  for (const auto& stream : streams)
    latest = std::max(latest, stream.end);
  for (auto& stream : streams)
    stream.is_cut_by_limit = stream.size + stream.largest_packet > limit && stream.end < latest;
}

std::string incompleteness_of(const StreamSummary& stream) {
  const auto file = in_quotes(stream.file);
  if (stream.is_cut_by_limit)
    return file + " has reached the limit of the size of files (ulimit -f): File too large";
  return stream.is_damaged ? file + " ends within a packet (is the disk full?)" : std::string();
}

bool has_events(const StreamSummary& stream) {
  const std::string name = stream.file.filename().string();
  const auto channel = channel_of(name);
  const bool describes = channel == kStateChannel || channel == kRos2StateChannel;
  return !describes && stream.content_bytes > stream.packets * kEmptyPacketBytes;
}

HeldTime held_by(const std::vector<StreamSummary>& streams) {
  const auto between = [](std::uint64_t begin, std::uint64_t end) {
    return std::chrono::nanoseconds(begin != 0 && end > begin ? end - begin : 0);
  };
  HeldTime held;
  std::uint64_t begin = 0;
  std::uint64_t end = std::numeric_limits<std::uint64_t>::max();
  for (const StreamSummary& stream : streams) {
    const bool is_hot = channel_of(stream.file.filename().string()) == kEventChannel;
    if (!is_hot || stream.packets == 0) continue;
    begin = std::max(begin, stream.begin);
    end = std::min(end, stream.end);
    if (stream.lost_packets == 0) continue;
    const auto own = between(stream.begin, stream.end);
    held.overwritten = std::min(held.overwritten.value_or(own), own);
  }
  held.common = between(begin, end);
  return held;
}

std::vector<AbsentChannel> absent_channels(const std::vector<StreamSummary>& streams,
                                           const std::vector<std::string>& channels) {
  std::map<fs::path, std::set<std::string>> seen;
  for (const auto& stream : streams) {
    const std::string name = stream.file.filename().string();
    seen[stream.file.parent_path()].emplace(channel_of(name));
  }
  std::vector<AbsentChannel> absent;
  for (const auto& [trace, of_trace] : seen) {
    for (const auto& channel : channels) {
      if (!of_trace.contains(channel)) absent.push_back({.trace = trace, .channel = channel});
    }
  }
  return absent;
}

std::vector<fs::path> empty_metadata(const fs::path& directory) {
  std::vector<fs::path> empty;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file() && entry.path().filename() == "metadata" &&
        entry.file_size() == 0) {
      empty.push_back(entry.path());
    }
  }
  return empty;
}

}  // namespace cie::record
