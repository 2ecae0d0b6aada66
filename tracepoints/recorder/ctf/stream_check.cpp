#include "ctf/stream_check.hpp"

#include "ctf/packet_start.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

bool is_stream(const fs::path& file) {
  const fs::path parent = file.parent_path();
  return file.filename() != "metadata" && parent.filename() != "index" &&
         fs::exists(parent / "metadata");
}

StreamSummary check_stream(const fs::path& file) {
  StreamSummary summary{.file = file};
  const std::uint64_t size = fs::file_size(file);
  std::ifstream stream(file, std::ios::binary);
  std::uint64_t position = 0;
  std::uint64_t expected = 0;
  while (position < size) {
    std::array<char, sizeof(PacketStart)> bytes{};
    stream.seekg(static_cast<std::streamoff>(position));
    if (!stream.read(bytes.data(), bytes.size())) {
      summary.is_damaged = true;
      break;
    }
    const auto packet = std::bit_cast<PacketStart>(bytes);
    const std::uint64_t length = packet.packet_bits / 8;
    if (packet.magic != kPacketMagic || packet.packet_bits % 8 != 0 ||
        length < sizeof(PacketStart) || packet.content_bits > packet.packet_bits ||
        length > size - position) {
      summary.is_damaged = true;
      break;
    }
    summary.lost_packets += packet.number > expected ? packet.number - expected : 0;
    expected = packet.number + 1;
    summary.next_packet = expected;
    if (summary.packets == 0) {
      summary.begin = packet.begin;
    }
    summary.end = packet.end;
    summary.discarded_events = packet.discarded_events;
    summary.content_bytes += packet.content_bits / 8;
    ++summary.packets;
    position += length;
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
  return summaries;
}

bool has_events(const StreamSummary& stream) {
  const bool describes = stream.file.filename().string().starts_with("state_") ||
                         stream.file.filename().string().starts_with("ros2_state_");
  return !describes && stream.content_bytes > stream.packets * kEmptyPacketBytes;
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
