#include "kernel_records.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>

namespace cie::analysis {

// What the channels of one trace cover together.
std::optional<Stretch> KernelRecords::covered(
    const std::vector<const ChannelWindows::Channel*>& channels) const {
  std::optional<Stretch> all;
  auto end = kLatest;
  for (const auto* channel : channels) {
    const auto window = windows_.covered(*channel);
    if (!window.begin && !windows_.is_idle(*channel)) return std::nullopt;
    if (window.begin)
      all = Stretch{.begin = std::max(all.value_or(Stretch{*window.begin}).begin, *window.begin)};
    end = std::min(end, window.end.value_or(kLatest));
  }
  if (all) all->end = end;
  return all && all->begin <= end ? all : std::nullopt;
}

std::vector<KernelPart> KernelRecords::parts_of(HostIndex host) const {
  std::map<std::uint32_t, std::vector<std::uint32_t>> traces;
  for (const auto& [number, channel] : windows_.channels()) {
    if (channel.domain != Domain::kernel || channel.host != host) continue;
    const auto first = channel.streams.front();
    if (coverage_.is_evidence(StreamIndex{first}))
      traces[model_.streams[first].trace].push_back(number);
  }
  std::vector<KernelPart> parts;
  for (const auto& [trace, numbers] : traces) {
    std::vector<const ChannelWindows::Channel*> channels;
    for (const auto number : numbers)
      channels.push_back(&windows_.channels().at(number));
    const auto& first = model_.streams[channels.front()->streams.front()];
    parts.push_back({.has_switches = first.has_inheritance.has_value(),
                     .cpus = coverage_.cpus_of(host, numbers),
                     .covers = covered(channels)});
  }
  return parts;
}

KernelRecords::Record& KernelRecords::record_of(HostIndex host) const {
  auto& record = records_[host];
  const auto changes = windows_.changes() + coverage_.changes();
  if (record.changes == changes) return record;
  record = {.changes = changes, .parts = parts_of(host), .of_all_cpus = {}, .of_cpu = {}};
  record.of_all_cpus = recorded(record.parts);
  record.are_cpus_alike = std::ranges::all_of(record.parts, [&record](const KernelPart& part) {
    return part.cpus == record.parts.front().cpus;
  });
  return record;
}

CoveredWindow KernelRecords::record(HostIndex host, Timestamp time,
                                    std::optional<std::int32_t> cpu) const {
  auto& record = record_of(host);
  const auto* stretches = &record.of_all_cpus;
  if (cpu && !record.are_cpus_alike) {
    const auto [of_cpu, is_new] = record.of_cpu.try_emplace(*cpu);
    if (is_new) of_cpu->second = recorded(record.parts, cpu);
    stretches = &of_cpu->second;
  }
  const auto next = std::ranges::upper_bound(*stretches, time, {}, &Stretch::begin);
  if (next == stretches->begin()) return {};
  const auto& stretch = *std::prev(next);
  return {.begin = stretch.begin, .end = stretch.end};
}

CoveredWindow KernelRecords::window(HostIndex host, Timestamp time,
                                    std::optional<std::int32_t> cpu) const {
  auto window = record(host, time, cpu);
  if (!asked_ || !window.begin) return window;
  window.begin = std::max(*window.begin, asked_->from);
  window.end = std::min(*window.end, asked_->to);
  return window;
}

std::optional<Timestamp> KernelRecords::begin(HostIndex host) const {
  const auto& stretches = record_of(host).of_all_cpus;
  return stretches.empty() ? std::nullopt : std::optional(stretches.front().begin);
}

// Kernel events of a boot in which none of its machine's applications was recorded: of a machine
// that was booted anew, most likely, for its namesake's were.
bool has_foreign_kernel(const Model& model) {
  std::map<std::string_view, int> namesakes;
  std::set<HostIndex> with_user_events;
  for (const auto& host : model.hosts)
    ++namesakes[host.told];
  for (const auto& stream : model.streams) {
    if (stream.domain == Domain::user) with_user_events.insert(stream.host);
  }
  return std::ranges::any_of(model.streams, [&](const StreamFacts& stream) {
    return stream.domain == Domain::kernel && !with_user_events.contains(stream.host) &&
           namesakes[model.hosts[at(stream.host)].told] > 1;
  });
}

}  // namespace cie::analysis
