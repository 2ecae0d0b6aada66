#include "metadata_rebuild.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/uuid.hpp"
#include "ctf/metadata/file.hpp"
#include "ctf/metadata/tokens.hpp"
#include "ctf/metadata/types.hpp"
#include "ctf/metadata/uuid.hpp"
#include "event_numbering.hpp"
#include "provider_schema.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace cie::analysis::ctf {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxPacket = 256U << 20U;
// Of a channel's packets so much is looked at: all of most recordings' channel "state".
constexpr std::uint64_t kMaxState = 64U << 20U;
constexpr std::uint64_t kMaxEventsOfFile = 1U << 20U;

struct Channel {
  std::optional<std::uint32_t> stream;
  std::vector<PacketBytes> packets;
  std::uint64_t bytes = 0;
};

std::optional<PacketHeader> header_at(const File& file, std::uint64_t offset) {
  std::array<std::uint8_t, sizeof(PacketHeader)> bytes{};
  if (file.read(offset, bytes) < bytes.size()) return std::nullopt;
  const auto header = packet_header(bytes, file.size() - offset);
  const bool is_sane = header && header->content_bits % 8 == 0 &&
                       header->content_bits >= kEmptyPacketBytes * 8 &&
                       header->packet_bits / 8 <= kMaxPacket;
  return is_sane ? header : std::nullopt;
}

// Only the begin of a channel was looked at. If what occurs there has the numbers that follow from
// the order of the provider, so has what occurs later.
Numbering with_unseen(Numbering seen, std::span<const ProviderEvent> classes) {
  const bool is_in_order = std::all_of(
      seen.begin(), seen.end(), [](const auto& entry) { return entry.first == entry.second; });
  for (std::size_t i = 0; is_in_order && i < classes.size(); ++i)
    seen.emplace(i, i);
  return seen;
}

struct StateClasses {
  std::span<const ProviderEvent> all;
  Numbering numbering;
};

// Those of today, or else older ones. Throws MetadataError if neither fits.
StateClasses state_classes(std::span<const PacketBytes> packets) {
  const auto numbered = [packets](std::span<const ProviderEvent> classes) {
    return StateClasses{.all = classes, .numbering = find_numbering(packets, classes)};
  };
  try {
    return numbered(state_channel_events());
  } catch (const MetadataError&) {
    return numbered(old_state_channel_events());
  }
}

class Rebuilder {
 public:
  void add(const fs::path& path) {
    const auto name = path.filename().string();
    const auto channel = std::string(channel_of(name));
    if (channel != kStateChannel && channel != kEventChannel) {
      throw MetadataError("its file " + name + " is of no channel of `cie record`");
    }
    add(File(path.string()), channels_[channel], channel == kStateChannel);
  }

  std::string text() {
    if (!uuid_) throw MetadataError("it has no packets");
    auto& state = channels_[std::string(kStateChannel)];
    auto& events = channels_[std::string(kEventChannel)];
    if (state.stream && state.stream == events.stream) {
      throw MetadataError("its channels have one and the same number");
    }
    TraceOrigin origin{.uuid = uuid_text(*uuid_), .host = {}, .clock_uuid = {}};
    std::string streams;
    if (state.stream) {
      const auto [classes, numbering] = state_classes(state.packets);
      if (const auto found = recorded_on(state.packets, classes, numbering)) {
        origin.host = found->host;
        origin.clock_uuid = found->boot_id;
        origin.clock_offset_ns = found->clock_offset_ns;
      }
      streams += stream_text(*state.stream);
      for (const auto& [id, number] : numbering)
        streams += event_text(classes[number], id, *state.stream);
    }
    if (events.stream) {
      const auto classes = event_channel_events();
      streams += stream_text(*events.stream);
      for (const auto& [id, number] : with_unseen(find_numbering(events.packets, classes), classes))
        streams += event_text(classes[number], id, *events.stream);
    }
    return trace_text(origin) + streams;
  }

 private:
  void add(const File& file, Channel& channel, bool is_state) {
    std::uint64_t of_file = 0;
    for (std::uint64_t offset = 0; offset < file.size();) {
      const auto header = header_at(file, offset);
      if (!header) return;  // what is damaged says nothing; the reader tells of it
      if (!uuid_) uuid_ = header->trace_uuid;
      if (!channel.stream) channel.stream = header->stream_id;
      if (*uuid_ != header->trace_uuid) throw MetadataError("its packets are of several traces");
      if (*channel.stream != header->stream_id) {
        throw MetadataError("a channel has streams of several classes");
      }
      PacketBytes packet{.begin = header->begin, .end = header->end, .events = {}};
      packet.events.resize(header->content_bits / 8 - kEmptyPacketBytes);
      of_file += packet.events.size();
      channel.bytes += packet.events.size();
      if (is_state && channel.bytes > kMaxState) {
        throw MetadataError("its channel \"state\" is larger than any honest one");
      }
      packet.events.resize(file.read(offset + kEmptyPacketBytes, packet.events));
      channel.packets.push_back(std::move(packet));
      if (!is_state && of_file > kMaxEventsOfFile) return;
      offset += header->packet_bits / 8;
    }
  }

  std::optional<Uuid> uuid_;
  std::map<std::string, Channel> channels_;
};

// What can be listed: the reader tells of the rest.
std::vector<fs::path> files_of(const fs::path& directory) {
  std::error_code ignored;
  return stream_files(directory, ignored);
}

}  // namespace

bool looks_recorded(const fs::path& directory) {
  const auto files = files_of(directory);
  return std::any_of(files.begin(), files.end(), [](const fs::path& path) {
    const auto name = path.filename().string();
    const auto channel = channel_of(name);
    if (channel.size() == name.size()) return false;
    if (channel != kStateChannel && channel != kEventChannel) return false;
    return header_at(File(path.string()), 0).has_value();
  });
}

bool has_packets(const fs::path& directory) {
  const auto files = files_of(directory);
  return std::any_of(files.begin(), files.end(), [](const fs::path& path) {
    std::array<std::uint8_t, sizeof kPacketMagic> begin{};
    if (File(path.string()).read(0, begin) != begin.size()) return false;
    std::uint32_t magic = 0;
    std::memcpy(&magic, begin.data(), sizeof magic);
    return magic == kPacketMagic || magic == __builtin_bswap32(kPacketMagic);
  });
}

std::string rebuild_metadata(const fs::path& directory) {
  Rebuilder rebuilder;
  for (const auto& path : files_of(directory))
    rebuilder.add(path);
  return rebuilder.text();
}

}  // namespace cie::analysis::ctf
