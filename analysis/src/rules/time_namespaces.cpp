#include "time_namespaces.hpp"

#include "judgement.hpp"

#include <algorithm>
#include <string>

namespace cie::analysis {
namespace {

bool is_of_report(const ProcessFacts& process, HostIndex host) {
  return process.host == host && process.has_cie_events;
}

// Of the host, in a time namespace; null: none is.
const ProcessFacts* in_namespace(const Model& model, HostIndex host) {
  const auto found = std::ranges::find_if(model.processes, [host](const ProcessFacts& process) {
    return is_of_report(process, host) && process.monotonic_offset_ns != 0;
  });
  return found != model.processes.end() ? &*found : nullptr;
}

Evidence clock_of(const ProcessFacts& process, const std::string& consequence) {
  const auto offset = process.monotonic_offset_ns;
  return evidence("clock", process.run_begin ? *process.run_begin : *process.first_seen,
                  "process " + std::to_string(process.pid) +
                      " is in a time namespace, where CLOCK_MONOTONIC is " +
                      nanoseconds(offset < 0 ? -offset : offset) +
                      (offset < 0 ? " behind" : " ahead of") + " the machine's: " + consequence);
}

}  // namespace

std::optional<Evidence> clocks_apart(const Model& model, HostIndex host) {
  const auto* apart = in_namespace(model, host);
  if (apart == nullptr) return std::nullopt;
  const bool is_any_other = std::ranges::any_of(model.processes, [&](const ProcessFacts& other) {
    return is_of_report(other, host) && other.monotonic_offset_ns != apart->monotonic_offset_ns;
  });
  if (!is_any_other) return std::nullopt;
  return clock_of(
      *apart, "its times cannot be compared with those of the other processes; record it apart");
}

std::map<HostIndex, Evidence> clocks_apart(const Model& model) {
  std::map<HostIndex, Evidence> apart;
  for (std::size_t i = 0; i < model.hosts.size(); ++i) {
    const auto host = HostIndex{static_cast<std::uint32_t>(i)};
    if (auto why = clocks_apart(model, host)) apart.emplace(host, *std::move(why));
  }
  return apart;
}

std::optional<Evidence> apart_from_kernel(const Model& model, HostIndex host) {
  const auto& facts = model.hosts[at(host)];
  const auto* apart = in_namespace(model, host);
  const bool has_kernel = facts.has_switches || facts.has_wakings || facts.has_forks;
  if (apart == nullptr || !has_kernel) return std::nullopt;
  return clock_of(*apart, "the kernel's events tell nothing of it");
}

}  // namespace cie::analysis
