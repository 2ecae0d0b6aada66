#include "missing_streams.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "ctf/metadata/uuid.hpp"
#include "discovery.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

namespace cie::analysis {
namespace {

namespace fs = std::filesystem;

// More CPUs than Linux can have (CONFIG_NR_CPUS) are a name's, not a machine's.
constexpr std::uint32_t kMaxCpus = 8192;

using ctf::Uuid;
using Cpus = std::set<std::uint32_t>;
using Channels = std::map<std::string, Cpus>;

struct Missing {
  std::string file;
  std::string why;
};
// What a directory shows of its trace.
struct TraceFiles {
  Uuid uuid{};
  std::set<std::string> streams;
  std::vector<Missing> missing;
};

// Names of files in `directory` that end so, without that.
std::set<std::string> names_in(const fs::path& directory, std::string_view ending) {
  std::set<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(directory, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    auto name = entry->path().filename().string();
    if (!name.ends_with(ending) || !entry->is_regular_file(ignored)) continue;
    name.resize(name.size() - ending.size());
    names.insert(std::move(name));
  }
  return names;
}

bool is_of_lttng_ust(const fs::path& directory) {
  constexpr std::size_t kEnvironmentWithin = 16'384;
  std::string begin(kEnvironmentWithin, '\0');
  std::ifstream file(directory / kMetadataName, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  return begin.find("\"lttng-ust\"") != std::string::npos;
}

struct Recorded {
  Uuid trace{};
  std::uint32_t stream = 0;  // of a channel's class
  std::uint32_t cpu = 0;
};
// What the file's first packet tells; empty: there is none.
std::optional<Recorded> recorded_in(const fs::path& path) {
  std::array<std::uint8_t, kEmptyPacketBytes> bytes{};
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (!file || error) return std::nullopt;
  const auto header = packet_header(std::span(bytes).first<sizeof(PacketHeader)>(), size);
  if (!header) return std::nullopt;
  Recorded recorded{.trace = header->trace_uuid, .stream = header->stream_id};
  std::memcpy(&recorded.cpu, bytes.data() + sizeof(PacketHeader), sizeof recorded.cpu);
  return recorded;
}

using Files = std::map<std::string, std::optional<Recorded>>;  // by name

struct StreamName {
  std::string_view channel;
  std::uint32_t cpu = 0;
};

// `is_split`: a stream has several files (`lttng enable-channel --tracefile-size`): "events_3_0".
std::optional<StreamName> stream_name(std::string_view file, bool is_split) {
  if (is_split && cpu_of(file) && cpu_of(channel_of(file))) file = channel_of(file);
  const auto cpu = cpu_of(file);
  if (!cpu || *cpu >= kMaxCpus) return std::nullopt;
  return StreamName{.channel = channel_of(file), .cpu = *cpu};
}

// By the names of its files; empty if those are not the names that LTTng gave them. What no file with a packet
// confirms is no channel.
Channels channels_of(const Files& files, bool is_split) {
  Channels channels;
  std::map<std::uint32_t, std::string> confirmed;  // by stream class
  for (const auto& [file, recorded] : files) {
    const auto name = stream_name(file, is_split);
    if (recorded && (!name || recorded->cpu != name->cpu)) return {};
    if (!name) continue;
    const std::string channel(name->channel);
    channels[channel].insert(name->cpu);
    if (!recorded) continue;
    if (confirmed.try_emplace(recorded->stream, channel).first->second != channel) return {};
  }
  std::erase_if(channels, [&confirmed](const auto& channel) {
    return std::ranges::none_of(
        confirmed, [&channel](const auto& other) { return other.second == channel.first; });
  });
  return channels;
}

std::vector<Missing> holes_in(const Channels& channels) {
  std::uint32_t cpus = 0;
  for (const auto& [channel, seen] : channels)
    cpus = std::max(cpus, *seen.rbegin() + 1);
  std::vector<Missing> holes;
  for (const auto& [channel, seen] : channels) {
    for (std::uint32_t cpu = 0; cpu < cpus; ++cpu) {
      if (seen.contains(cpu)) continue;
      const auto sister = std::ranges::find_if(
          channels, [cpu](const auto& other) { return other.second.contains(cpu); });
      const auto other = sister != channels.end() ? sister->first + '_' + std::to_string(cpu)
                                                  : channel + '_' + std::to_string(*seen.rbegin());
      holes.push_back({.file = channel + '_' + std::to_string(cpu),
                       .why = other + " is here: LTTng writes a file for each channel and CPU"});
    }
  }
  return holes;
}

TraceFiles files_of(const fs::path& directory) {
  if (!is_of_lttng_ust(directory)) return {};
  TraceFiles found;
  found.streams = names_in(directory, "");
  found.streams.erase(kMetadataName);
  Files files;
  for (const auto& name : found.streams) {
    const auto& recorded = files.emplace(name, recorded_in(directory / name)).first->second;
    if (recorded) found.uuid = recorded->trace;
  }
  // A channel's name may end with a number, too: what has a reading without holes has none.
  bool is_any = false;
  for (const bool is_split : {false, true}) {
    const auto channels = channels_of(files, is_split);
    if (channels.empty()) continue;
    auto holes = holes_in(channels);
    if (!is_any || holes.size() < found.missing.size()) found.missing = std::move(holes);
    is_any = true;
  }
  if (!is_any) return {};
  for (const auto& name : names_in(directory / kIndexDirectory, ".idx")) {
    const bool is_told =
        std::ranges::find(found.missing, name, &Missing::file) != found.missing.end();
    if (!is_told && !found.streams.contains(name))
      found.missing.push_back({.file = name, .why = "its index is here"});
  }
  return found;
}

// Parts of one trace have no file in common; its chunks have all.
bool has_part(const TraceFiles& part, const TraceFiles& other, const std::string& file) {
  return other.uuid == part.uuid && other.streams.contains(file) &&
         std::ranges::none_of(part.streams, [&other](const std::string& own) {
           return other.streams.contains(own);
         });
}

}  // namespace

std::vector<std::vector<std::string>> missing_streams(std::span<const fs::path> directories) {
  std::vector<TraceFiles> traces;
  for (const auto& directory : directories)
    traces.push_back(files_of(directory));
  std::vector<std::vector<std::string>> lines;
  for (const auto& trace : traces) {
    auto& of_trace = lines.emplace_back();
    for (const auto& [file, why] : trace.missing) {
      const bool is_elsewhere = std::ranges::any_of(
          traces,
          [&trace, &file = file](const TraceFiles& other) { return has_part(trace, other, file); });
      if (!is_elsewhere) of_trace.emplace_back(file).append(" is missing, and ").append(why);
    }
  }
  return lines;
}

}  // namespace cie::analysis
