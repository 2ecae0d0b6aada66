#include "missing_streams.hpp"

#include <cie/tracepoints/recording_layout.hpp>

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

using Cpus = std::set<std::uint32_t>;
using Channels = std::map<std::string, Cpus>;

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

// Of the file's first packet; empty: there is none.
std::optional<std::uint32_t> recorded_cpu(const fs::path& path) {
  std::array<std::uint8_t, kEmptyPacketBytes> bytes{};
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  std::error_code error;
  const auto size = fs::file_size(path, error);
  const auto header = std::span(bytes).first<sizeof(PacketHeader)>();
  if (!file || error || !packet_header(header, size)) return std::nullopt;
  std::uint32_t cpu = 0;
  std::memcpy(&cpu, bytes.data() + header.size(), sizeof cpu);
  return cpu;
}

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

// By the names of its files; empty if those are not the names that LTTng gave them.
Channels channels_of(const fs::path& directory, const std::set<std::string>& files, bool is_split) {
  Channels channels;
  bool is_confirmed = false;
  for (const auto& file : files) {
    const auto name = stream_name(file, is_split);
    const auto recorded = recorded_cpu(directory / file);
    if (recorded && (!name || *recorded != name->cpu)) return {};
    if (name) channels[std::string(name->channel)].insert(name->cpu);
    is_confirmed = is_confirmed || recorded;
  }
  return is_confirmed ? channels : Channels{};
}

std::vector<std::string> holes_in(const Channels& channels) {
  std::uint32_t cpus = 0;
  for (const auto& [channel, seen] : channels)
    cpus = std::max(cpus, *seen.rbegin() + 1);
  std::vector<std::string> holes;
  for (const auto& [channel, seen] : channels) {
    for (std::uint32_t cpu = 0; cpu < cpus; ++cpu) {
      if (seen.contains(cpu)) continue;
      const auto sister = std::ranges::find_if(
          channels, [cpu](const auto& other) { return other.second.contains(cpu); });
      const auto other = sister != channels.end() ? sister->first + '_' + std::to_string(cpu)
                                                  : channel + '_' + std::to_string(*seen.rbegin());
      holes.push_back(channel + '_' + std::to_string(cpu) + " is missing, and " + other +
                      " is here: LTTng writes a file for each channel and CPU");
    }
  }
  return holes;
}

}  // namespace

std::vector<std::string> missing_streams(const fs::path& directory) {
  if (!is_of_lttng_ust(directory)) return {};
  const auto files = names_in(directory, "");
  // A channel's name may end with a number, too: what has a reading without holes has none.
  std::optional<std::vector<std::string>> missing;
  for (const bool is_split : {false, true}) {
    const auto channels = channels_of(directory, files, is_split);
    if (channels.empty()) continue;
    auto holes = holes_in(channels);
    if (!missing || holes.size() < missing->size()) missing = std::move(holes);
  }
  if (!missing) return {};
  for (const auto& name : names_in(directory / "index", ".idx")) {
    const bool is_told = std::ranges::any_of(
        *missing, [&name](const std::string& line) { return line.starts_with(name + ' '); });
    if (!is_told && !files.contains(name))
      missing->push_back(name + " is missing, and its index is here");
  }
  return *std::move(missing);
}

}  // namespace cie::analysis
