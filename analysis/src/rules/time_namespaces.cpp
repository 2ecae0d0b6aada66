#include "time_namespaces.hpp"

#include <cie/analysis/note.hpp>

#include "judgement.hpp"

#include <algorithm>
#include <utility>

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

Evidence clock_of(const ProcessFacts& process, Note consequence) {
  const auto offset = process.monotonic_offset_ns;
  return evidence("clock", process.run_begin ? *process.run_begin : *process.first_seen,
                  note(offset < 0 ? "clock-behind-machine" : "clock-ahead-of-machine",
                       {{"pid", process.pid},
                        {"offset", Duration{offset < 0 ? -offset : offset}},
                        {"consequence", std::move(consequence)}}));
}

}  // namespace

std::optional<Evidence> clocks_apart(const Model& model, HostIndex host) {
  const auto* apart = in_namespace(model, host);
  if (apart == nullptr) return std::nullopt;
  const bool is_any_other = std::ranges::any_of(model.processes, [&](const ProcessFacts& other) {
    return is_of_report(other, host) && other.monotonic_offset_ns != apart->monotonic_offset_ns;
  });
  if (!is_any_other) return std::nullopt;
  return clock_of(*apart, note("times-not-comparable"));
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
  return clock_of(*apart, note("kernel-tells-nothing-of-it"));
}

}  // namespace cie::analysis
