#include "chain_report.hpp"

#include "base/prefetch.hpp"
#include "model/clock_differences.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace cie::analysis {
namespace {

// Its quantities will be asked for soon: they lie far from each other.
void prefetch(const ChainFacts& facts) {
  for (const auto* quantity : {&facts.path_latency, &facts.reaction_time, &facts.data_age})
    prefetch_to_read(quantity->memory());
  for (const auto* cells : {&facts.processing, &facts.communication}) {
    for (const auto& cell : *cells)
      prefetch_to_read(cell.memory());
  }
}

void fill(ChainReport& report, const Model& model, ChainIndex index) {
  const auto& facts = model.chains[at(index)];
  report.index = index;
  report.name = facts.name;
  report.process = facts.process;
  report.hops = facts.hops;
  report.is_specified = facts.specified;
  report.callbacks = facts.last_callbacks;
  report.instances = facts.instances;
  report.path_latency = facts.path_latency.summary();
  report.reaction_time = facts.reaction_time.summary();
  report.data_age = facts.data_age.summary();
  report.from_start = facts.from_start.summary();
  report.path_latency_upper = facts.path_latency_upper.summary();
  report.response = facts.response.summary();
  report.clock_error = clock_error(model, facts);
  // Nothing of a chain without instances.
  const auto summary_at = [](const std::vector<Statistics>& cells, std::size_t i) {
    return i < cells.size() ? cells[i].summary() : Rare<Summary>();
  };
  const auto callback_at = [&facts](std::size_t i) {
    const auto& known = facts.last_callbacks;
    return i < known.size() ? std::optional(known[i]) : std::nullopt;
  };
  report.hop_table.reserve(facts.hops.size());
  for (std::size_t i = 0; i < facts.hops.size(); ++i) {
    auto& hop = report.hop_table.emplace_back();
    hop.from = facts.hops[i];
    hop.from_callback = callback_at(i);
    hop.processing = summary_at(facts.processing, i);
    hop.start_to_publish = summary_at(facts.running, i);
    if (i + 1 < facts.hops.size()) {
      hop.to = facts.hops[i + 1];
      hop.to_callback = callback_at(i + 1);
      hop.communication = summary_at(facts.communication, i);
      hop.clock_error = clock_error(model, facts, i);
      hop.publish_to_start = summary_at(facts.handover, i);
    }
  }
  report.undivided = facts.undivided.summary();
}

}  // namespace

std::vector<ChainReport> chain_reports(const Model& model) {
  std::vector<ChainReport> reports;
  reports.reserve(model.chains.size());
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    if (i + 1 < model.chains.size()) prefetch(model.chains[i + 1]);
    fill(reports.emplace_back(), model, ChainIndex{static_cast<std::uint32_t>(i)});
  }
  return reports;
}

}  // namespace cie::analysis
