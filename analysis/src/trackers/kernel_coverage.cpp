#include "kernel_coverage.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::int32_t kMaxCpus = 65'536;

}  // namespace

KernelCoverage::Cpu* KernelCoverage::cpu_of(Host& host, std::int32_t number) {
  if (number < 0 || number >= kMaxCpus) return nullptr;
  const auto place = static_cast<std::size_t>(number);
  if (place >= host.cpus.size()) host.cpus.resize(place + 1);
  return &host.cpus[place];
}

void KernelCoverage::begin(const EventHead& head, const StreamBegin& event, HostIndex host) {
  auto& stream = streams_[head.stream];
  stream.is_kernel = event.domain == Domain::kernel;
  stream.host = host;
  stream.channel = event.channel;
  stream.trace = event.trace;
  stream.may_repeat = event.has_inheritance.has_value();
  stream.is_left_out = event.is_left_out;
  auto& of_host = hosts_[host];
  if (stream.is_kernel) {
    relate();
    if (head.cpu) note_cpu(stream, *head.cpu);
    return;
  }
  if (head.cpu && event.has_events == true) see(host, *head.cpu);
  if (of_host.user_clock == event.clock_uuid) return;
  of_host.has_other_user_clock = of_host.user_clock.has_value();
  if (!of_host.user_clock) of_host.user_clock = event.clock_uuid;
  relate();
}

bool KernelCoverage::is_related(const Stream& stream, const std::string& clock) const {
  const auto& host = *hosts_.find(stream.host);
  if (host.user_clock) return !host.has_other_user_clock && host.user_clock == clock;
  // No application of this boot was recorded. If some of a machine of the same name were, it is
  // theirs, most likely, and was booted anew.
  const auto& told = model_.hosts[at(stream.host)].told;
  for (std::size_t i = 0; i < model_.hosts.size(); ++i) {
    const auto* other = hosts_.find(HostIndex{static_cast<std::uint32_t>(i)});
    if (other != nullptr && other->user_clock && model_.hosts[i].told == told) return false;
  }
  return true;
}

void KernelCoverage::relate() {
  std::set<std::pair<HostIndex, std::uint32_t>> unrelated;  // channels
  for (std::size_t i = 0; i < model_.streams.size(); ++i) {
    auto* stream = streams_.find(StreamIndex{static_cast<std::uint32_t>(i)});
    if (stream == nullptr || !stream->is_kernel) continue;
    const bool is_related = this->is_related(*stream, model_.streams[i].clock_uuid);
    if (is_related == stream->is_evidence) continue;
    auto& host = hosts_[stream->host];
    if (is_related) {
      stream->is_evidence = true;
      ++host.streams;
      ++evidence_;
      if (stream->cpu) note_cpu(*stream, *stream->cpu);
    } else {
      set_open(*stream, false);
      stream->is_evidence = false;
      --host.streams;
      --evidence_;
      unrelated.emplace(stream->host, stream->channel);
    }
    change(host);
  }
  for (const auto& [host, channel] : unrelated)
    hosts_[host].channels.erase(channel);
}

void KernelCoverage::change(Host& host) {
  host.covered.reset();
  host.is_whole.reset();
  ++changes_;
}

void KernelCoverage::set_open(Stream& stream, bool is_open) {
  if (!stream.is_evidence || stream.is_open == is_open) return;
  stream.is_open = is_open;
  auto& host = hosts_[stream.host];
  auto* cpu = stream.cpu ? cpu_of(host, *stream.cpu) : nullptr;
  if (is_open) {
    ++host.open;
    if (cpu != nullptr) ++cpu->open;
  } else {
    --host.open;
    if (cpu != nullptr) --cpu->open;
  }
}

void KernelCoverage::note_cpu(Stream& stream, std::int32_t number) {
  const bool was_open = stream.is_open;
  set_open(stream, false);
  stream.cpu = number;
  if (stream.is_evidence && stream.is_left_out) {
    see(stream.host, number);
  } else if (stream.is_evidence) {
    auto& host = hosts_[stream.host];
    if (host.channels[stream.channel].cpus.insert(number).second) change(host);
  }
  set_open(stream, was_open);
}

void KernelCoverage::note_switches(Stream& stream, std::int32_t number) {
  if (stream.cpu != number) note_cpu(stream, number);
  stream.has_switches = true;
  auto& host = hosts_[stream.host];
  auto& channel = host.channels[stream.channel];
  if (channel.has_switches) return;
  channel.has_switches = true;
  change(host);
}

bool KernelCoverage::are_beside(const Stream& one, const Stream& other) {
  return one.may_repeat && other.may_repeat && one.is_open && other.is_open &&
         one.host == other.host && one.cpu == other.cpu;
}

template <typename Function>
void KernelCoverage::each_kernel_stream(const Function& function) {
  for (auto& stream : streams_) {
    if (stream.is_kernel) function(stream);
  }
}

std::optional<std::int32_t> KernelCoverage::begin_packet(const EventHead& head) {
  auto* stream = streams_.find(head.stream);
  if (stream == nullptr || !stream->is_kernel) return std::nullopt;
  if (head.cpu && stream->cpu != head.cpu) note_cpu(*stream, *head.cpu);
  const bool was_open = stream->is_open;
  set_open(*stream, true);
  if (was_open || !stream->is_open || !stream->cpu) return std::nullopt;
  each_kernel_stream([stream](const Stream& other) {
    if (other.trace == stream->trace || other.told_until == kLatest) return;
    if (are_beside(*stream, other)) stream->told_until = kLatest;
  });
  const auto* cpu = cpu_of(hosts_[stream->host], *stream->cpu);
  const bool is_anew = cpu != nullptr && cpu->open == 1 && cpu->ended &&
                       cpu->ended_trace != stream->trace && head.time.ns - 1 > (*cpu->ended).ns;
  return is_anew ? stream->cpu : std::nullopt;
}

void KernelCoverage::end(StreamIndex index, Timestamp time) {
  auto* ended = streams_.find(index);
  if (ended == nullptr || !ended->is_open) return;
  if (ended->told_until != kLatest) hand_over(*ended);
  set_open(*ended, false);
  auto* cpu = ended->cpu ? cpu_of(hosts_[ended->host], *ended->cpu) : nullptr;
  if (cpu == nullptr) return;
  cpu->ended = time;
  cpu->ended_trace = ended->trace;
}

void KernelCoverage::hand_over(const Stream& ended) {
  std::optional<std::uint32_t> next;  // trace
  each_kernel_stream([&](const Stream& other) {
    if (!next && other.trace != ended.trace && are_beside(ended, other)) next = other.trace;
  });
  if (!next) return;
  each_kernel_stream([&](Stream& other) {
    if (are_beside(ended, other)) {
      other.told_until = other.trace == *next ? ended.last_switch : kLatest;
    }
  });
}

void KernelCoverage::expect(HostIndex index, std::uint32_t online_cpus) {
  auto& host = hosts_[index];
  if (online_cpus <= host.online_cpus) return;
  host.online_cpus = online_cpus;
  change(host);
}

std::set<std::int32_t> KernelCoverage::cpus_of(HostIndex index,
                                               std::span<const std::uint32_t> channels) const {
  std::set<std::int32_t> all;
  std::set<std::int32_t> with_switches;
  const auto& host = *hosts_.find(index);
  for (const auto number : channels) {
    const auto found = host.channels.find(number);
    if (found == host.channels.end()) continue;
    const auto& [cpus, has_switches] = found->second;
    all.insert(cpus.begin(), cpus.end());
    if (has_switches) with_switches.insert(cpus.begin(), cpus.end());
  }
  return with_switches.empty() ? all : with_switches;
}

std::optional<std::int32_t> KernelCoverage::cpu_of(StreamIndex stream) const {
  const auto* found = streams_.find(stream);
  return found != nullptr && found->is_kernel ? found->cpu : std::nullopt;
}

bool KernelCoverage::see_first(HostIndex index, std::int32_t number) {
  auto& host = hosts_[index];
  auto* cpu = cpu_of(host, number);
  if (cpu == nullptr) return host.open == 0;
  cpu->is_seen = true;
  change(host);
  return cpu->open > 0 || host.open == 0;
}

const std::set<std::int32_t>& KernelCoverage::covered(Host& host) {
  if (host.covered) return *host.covered;
  auto& cpus = host.covered.emplace();
  const bool has_switches = std::ranges::any_of(
      host.channels, [](const auto& entry) { return entry.second.has_switches; });
  for (const auto& [number, channel] : host.channels) {
    if (has_switches == channel.has_switches) cpus.insert(channel.cpus.begin(), channel.cpus.end());
  }
  return cpus;
}

bool KernelCoverage::covers(HostIndex index, std::int32_t cpu) const {
  auto* host = hosts_.find(index);
  return host != nullptr && covered(*host).contains(cpu);
}

bool KernelCoverage::covers(HostIndex index, std::span<const std::uint32_t> cpus) const {
  return !cpus.empty() && std::ranges::all_of(cpus, [this, index](std::uint32_t cpu) {
    return covers(index, static_cast<std::int32_t>(cpu));
  });
}

std::uint32_t KernelCoverage::missing(Host& host) {
  const auto& cpus = covered(host);
  std::uint32_t unseen = 0;
  for (std::size_t i = 0; i < host.cpus.size(); ++i) {
    if (host.cpus[i].is_seen && !cpus.contains(static_cast<std::int32_t>(i))) ++unseen;
  }
  const auto count = static_cast<std::uint32_t>(cpus.size());
  return std::max(unseen, host.online_cpus > count ? host.online_cpus - count : 0);
}

bool KernelCoverage::covers_all(HostIndex index) const {
  auto* host = hosts_.find(index);
  if (host == nullptr) return true;
  if (!host->is_whole) host->is_whole = missing(*host) == 0;
  return *host->is_whole;
}

void KernelCoverage::finish() {
  for (std::size_t i = 0; i < model_.hosts.size(); ++i) {
    auto* host = hosts_.find(HostIndex{static_cast<std::uint32_t>(i)});
    const bool has_kernel = host != nullptr && host->streams > 0;
    model_.hosts[i].cpus_not_recorded = has_kernel ? missing(*host) : 0;
  }
}

}  // namespace cie::analysis
