// What leaves a chain undecided although its instances were seen.
#include "chain_tracker.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

namespace cie::analysis {
namespace {

bool is_same(const EventRef& one, const EventRef& other) {
  return one.time == other.time && one.tid == other.tid && one.stream == other.stream;
}

}  // namespace

std::array<std::optional<ChainExtreme>*, 4> ChainTracker::extremes_of(ChainFacts& facts) {
  return {&facts.max_path_latency, &facts.max_path_latency_lower, &facts.max_reaction_time,
          &facts.max_data_age};
}

void ChainTracker::note_unproven(Chain& chain, const Nodes& nodes, const EventRef& end) {
  const auto later = std::span(nodes).subspan(1);
  const auto is_awaited = [](const ChainNode* node) { return node->parent->is_end_awaited; };
  if (std::ranges::none_of(later, is_awaited)) return;
  Unproven unproven{.end = end, .publishers = {}};
  for (const auto* node : later) {
    if (is_awaited(node)) unproven.publishers.push_back(node->parent);
  }
  const auto extremes = extremes_of(chain.facts);
  for (std::size_t i = 0; i < extremes.size(); ++i) {
    const auto& extreme = *extremes[i];
    if (extreme && is_same(extreme->last_end, end)) chain.unproven[i] = unproven;
  }
}

void ChainTracker::tell_unproven(const Chain& chain, ChainFacts& facts) {
  const auto extremes = extremes_of(facts);
  for (std::size_t i = 0; i < extremes.size(); ++i) {
    const auto& [end, publishers] = chain.unproven[i];
    auto& extreme = *extremes[i];
    if (!extreme || !is_same(extreme->last_end, end)) continue;
    extreme->is_unproven = std::ranges::any_of(
        publishers, [](const ChainNodeRef& node) { return node->is_end_awaited; });
  }
}

}  // namespace cie::analysis
