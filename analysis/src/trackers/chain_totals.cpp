// What a chain tracker knows of chains and edges, as the model's facts.
#include "base/prefetch.hpp"
#include "chain_tracker.hpp"
#include "model/sort_rows.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace cie::analysis {

void ChainTracker::look() {
  for (auto& waiting : waiting_)
    measure_decided(waiting, kMaxWaiting);
  fill_model([](const auto& facts) { return facts; });
}

void ChainTracker::finish() {
  fill_model([](auto& facts) { return std::move(facts); });
}

std::optional<ProcessIndex> ChainTracker::process_of(const Chain& chain) const {
  if (chain.hops.empty()) return std::nullopt;
  const auto of = [this](CallbackIndex hop) { return model_.callbacks[at(hop)].process; };
  const auto process = of(chain.hops.front());
  const auto is_within = [&](const std::vector<CallbackIndex>& hops) {
    return std::ranges::all_of(hops, [&](CallbackIndex hop) { return of(hop) == process; });
  };
  const bool is_only =
      is_within(chain.hops) &&
      std::ranges::all_of(chain.others, [&](const auto& other) { return is_within(other.first); });
  return is_only ? std::optional(process) : std::nullopt;
}

template <typename Take>
void ChainTracker::fill_model(Take take) {
  model_.chains.clear();
  model_.edges.clear();
  const auto add = [this](const Chain& chain, ChainFacts facts) {
    facts.process = process_of(chain);
    facts.last_callbacks = chain.hops;
    tell_unproven(chain, facts);
    tell_unlinked(chain, facts);
    model_.chains.push_back(std::move(facts));
  };
  model_.edges.reserve(edges_.size());
  for (auto& [key, edge] : edges_)
    model_.edges.push_back(take(edge));
  model_.chains.reserve(specified_.size() + paths_.size());
  for (auto& chain : specified_) {
    add(chain, take(chain.facts));
    tell_unanswered(chain, model_.chains.back());
  }
  std::vector<std::pair<std::string, Paths::value_type*>> listed;
  listed.reserve(paths_.size());
  for (auto entry = paths_.begin(); entry != paths_.end(); ++entry) {
    if (entry->second.facts.instances == 0 || is_rest(entry->second)) continue;
    // Paths are in lexical order: the ones that go on from this one follow it directly.
    const auto& path = entry->first;
    const auto next = std::find_if(std::next(entry), paths_.end(), [](const auto& other) {
      return other.second.facts.instances != 0;
    });
    const bool goes_on = next != paths_.end() && next->first.size() > path.size() &&
                         std::equal(path.begin(), path.end(), next->first.begin());
    if (goes_on || entry->second.goes_on) continue;
    std::string name;
    for (const auto hop : path) {
      if (!name.empty()) name += " -> ";
      name += model_.callbacks[at(hop)].logical_id;
    }
    listed.emplace_back(std::move(name), &*entry);
  }
  sort_rows(listed, {}, &decltype(listed)::value_type::first);
  for (std::size_t i = 0; i < listed.size(); ++i) {
    if (i + 2 < listed.size()) prefetch_to_read(&listed[i + 2].second->second.facts);
    auto& [name, entry] = listed[i];
    auto facts = take(entry->second.facts);
    facts.name = std::move(name);
    facts.hops.reserve(entry->first.size());
    for (const auto hop : entry->first)
      facts.hops.push_back(model_.callbacks[at(hop)].logical_id);
    add(entry->second, std::move(facts));
  }
}

}  // namespace cie::analysis
