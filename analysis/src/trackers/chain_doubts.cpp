// What leaves a chain undecided although its instances were seen.
#include "chain_tracker.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxUnlinked = 1024;  // callbacks and writers, per chain

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
  const auto is_untold = [](const ChainNode* node) {
    return node->parent->end == ChainNode::End::untold;
  };
  if (std::ranges::none_of(later, is_untold)) return;
  Unproven unproven{.end = end, .publishers = {}};
  for (const auto* node : later) {
    if (is_untold(node)) unproven.publishers.push_back(node->parent);
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
        publishers, [](const ChainNodeRef& node) { return node->end == ChainNode::End::untold; });
  }
}

void ChainTracker::note_unlinked(Chain& chain, const ChainNode& node, std::size_t hop) const {
  const bool is_named = model_.callbacks[at(node.callback)].registered.has_value();
  const auto gid = is_named ? node.writer_gid : 0;
  if (is_named && gid == 0) return;  // it took no message
  const auto is_of = [&](const Unlinked& known) {
    return known.callback == node.callback && known.hop == hop && known.writer_gid == gid;
  };
  auto& all = chain.unlinked;
  auto known = std::ranges::find_if(all.rbegin(), all.rend(), is_of);
  if (known == all.rend()) {
    if (all.size() >= kMaxUnlinked) return;
    all.push_back(Unlinked{.callback = node.callback,
                           .hop = hop,
                           .writer_gid = gid,
                           .host = node.host,
                           .first = node.start});
    known = all.rbegin();
  }
  ++known->count;
  known->last_written = std::max(known->last_written, node.source_timestamp);
}

void ChainTracker::tell_unlinked(const Chain& chain, ChainFacts& facts) const {
  const auto is_known_since = [&](const Unlinked& unlinked) {
    if (unlinked.writer_gid == 0) {
      const auto& callback = model_.callbacks[at(unlinked.callback)];
      return callback.registered && callback.logical_id == facts.hops[unlinked.hop];
    }
    const auto publisher = registry_.publisher_by_gid(unlinked.host, unlinked.writer_gid);
    if (!publisher) return false;
    const auto first = model_.publishers[*publisher].first_source_timestamp;
    return first != 0 && first <= unlinked.last_written;
  };
  for (const auto& unlinked : chain.unlinked) {
    if (!is_known_since(unlinked)) continue;
    facts.unlinked += unlinked.count;
    if (!facts.first_unlinked || unlinked.first.time < facts.first_unlinked->time)
      facts.first_unlinked = unlinked.first;
  }
}

void ChainTracker::note_cut_begin(Chain& chain, const ChainNode& first) {
  if (first.link != ChainNode::Link::before) return;
  ++chain.cut_instances;
  chain.cut_publisher =
      registry_.publisher_by_gid(first.host, first.writer_gid).value_or(chain.cut_publisher);
}

// Of a publisher none of whose messages was seen all that is known begins with its readers.
bool ChainTracker::is_rest(const Chain& chain) const {
  return chain.cut_instances != 0 && chain.cut_instances == chain.facts.instances &&
         model_.publishers[chain.cut_publisher].first_source_timestamp != 0;
}

void ChainTracker::tell_unanswered(const Chain& chain, ChainFacts& facts) const {
  const auto& progress = chain.progress;
  const auto* reads = progress.has_last ? reads_.find(chain.hops.front()) : nullptr;
  if (reads == nullptr) return;
  const auto next = progress.unanswered + 1;
  if (next >= reads->count()) return;
  facts.unanswered = {.reads = reads->count() - next,
                      .first = (*reads)[std::max(next, reads->oldest())],
                      .last = (*reads)[reads->count() - 1]};
}

}  // namespace cie::analysis
