#include "chain_tracker.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <span>

namespace cie::analysis {
namespace {

constexpr std::uint32_t kMaxHops = 32;
constexpr std::size_t kMaxPaths = 4096;
constexpr std::size_t kMaxWaitingInAll = 10'000;

// `longest`: what the extreme is.
void keep_larger(std::optional<ChainExtreme>& extreme, Greatest& longest, Duration value,
                 const EventRef& start, const EventRef& end) {
  if (longest.rise(value)) [[unlikely]]
    extreme = ChainExtreme{.value = value, .first_start = start, .last_end = end};
}

HostRoute route_of(std::span<const ChainNode* const> nodes) {
  HostRoute route;
  for (const auto* next : nodes.subspan(1)) {
    const bool is_same_host = next->writer_host == next->host;
    route.push_back(is_same_host ? std::nullopt
                                 : std::optional(HostPair{next->writer_host, next->host}));
  }
  return route;
}

// With the callbacks of these instances, the last one first.
bool ends_with(const std::vector<CallbackIndex>& callbacks,
               const std::vector<const ChainNode*>& known) {
  return callbacks.size() >= known.size() &&
         std::equal(known.begin(), known.end(), callbacks.rbegin(),
                    [](const ChainNode* node, CallbackIndex hop) { return node->callback == hop; });
}

}  // namespace

ChainTracker::ChainTracker(Model& model, Registry& registry, HostClocks& clocks,
                           const LossTimes& losses, const SchedulingSpec* spec)
    : model_(model),
      registry_(registry),
      clocks_(clocks),
      losses_(losses),
      has_spec_(spec != nullptr),
      most_hops_(kMaxHops) {
  if (!has_spec_) return;
  for (const auto& chain : spec->chains()) {
    Chain entry;
    entry.facts.name = chain.name;
    entry.facts.specified = true;
    entry.facts.hops = chain.callbacks;
    most_hops_ = std::max(most_hops_, static_cast<std::uint32_t>(chain.callbacks.size()));
    specified_.push_back(std::move(entry));
  }
}

[[gnu::always_inline]] inline void ChainTracker::measure(ChainNode& node, const EventRef& end) {
  note_edge(node);
  if (has_spec_) {
    for (auto& chain : specified_)
      on_specified(node, end, chain);
  } else {
    on_path(node, end);
  }
}

void ChainTracker::on_complete(ChainNode& node, const EventRef& end) {
  resolve(node);  // the publisher may have been announced in between
  if (waiting_count_ > 0 || is_end_awaited_before(node)) [[unlikely]] {
    on_complete_beside_waiting(node, end);
  } else {
    measure(node, end);
  }
}

// Apart from what is done for every instance.
[[gnu::noinline]] void ChainTracker::on_complete_beside_waiting(ChainNode& node,
                                                                const EventRef& end) {
  const bool may_wait = waiting_count_ < kMaxWaitingInAll;
  auto& waiting = waiting_[node.callback];
  measure_decided(waiting, may_wait ? kMaxWaiting - 1 : 0);
  if (waiting.empty() && !(may_wait && is_end_awaited_before(node))) {
    measure(node, end);
    return;
  }
  waiting.push_back({.node = ChainNodeRef(node), .end = end});
  ++waiting_count_;
}

bool ChainTracker::is_end_awaited_before(const ChainNode& node) noexcept {
  for (const auto* before = node.parent.get(); before != nullptr; before = before->parent.get()) {
    if (before->end == ChainNode::End::awaited) return true;
  }
  return false;
}

void ChainTracker::measure_decided(std::vector<Waiting>& waiting, std::size_t most) {
  std::size_t decided = 0;
  while (decided < waiting.size() &&
         (waiting.size() - decided > most || !is_end_awaited_before(*waiting[decided].node))) {
    measure(*waiting[decided].node, waiting[decided].end);
    ++decided;
  }
  waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(decided));
  waiting_count_ -= decided;
}

void ChainTracker::measure_waiting() {
  std::vector<Waiting> all;
  for (auto& waiting : waiting_) {
    std::ranges::move(waiting, std::back_inserter(all));
    waiting.clear();
  }
  waiting_count_ = 0;
  std::ranges::stable_sort(all, {}, [](const Waiting& waiting) { return waiting.end.time; });
  for (const auto& [node, end] : all)
    measure(*node, end);
}

void ChainTracker::on_path(ChainNode& node, const EventRef& end) {
  const auto walked = walk(node);
  if (walked == Walk::missing) interrupt(scratch_);
  if (walked != Walk::whole && walked != Walk::too_long) return;
  if (walked == Walk::whole) {
    if (auto* chain = chain_of(scratch_)) {
      note_cut_begin(*chain, *scratch_.front());
      measure(*chain, scratch_, end);
      return;
    }
  } else if (node.parent && walk(*node.parent) == Walk::whole) {
    if (auto* chain = chain_of(scratch_)) chain->goes_on = true;
  }
  ++model_.unlisted_chain_instances;
}

// It may be an instance of each chain that ends like this and is no shorter: the next one of these
// follows one that is not known.
void ChainTracker::interrupt(const Nodes& known) {
  for (auto* path : ended_by_[known.front()->callback]) {
    if (ends_with(path->first, known)) path->second.progress.has_last = false;
  }
}

void ChainTracker::on_response(HostIndex host, const ResponseTaken& event, Timestamp taken) {
  const auto publisher = registry_.publisher_by_gid(host, event.writer_gid);
  if (!publisher) return;
  const auto* response = find_message(*publisher, event.source_timestamp_realtime_ns);
  if (response == nullptr || !response->node || response->node->end == ChainNode::End::lost) return;
  auto& node = *response->node;
  const auto begin = sent(host, node.host, response->time, event.source_timestamp_realtime_ns);
  if (!begin) return;
  resolve(node);
  const auto add = [&](Chain& chain) { chain.facts.response.add(taken - *begin); };
  if (has_spec_) {
    for (auto& chain : specified_) {
      if (walk(node, chain) == Walk::whole) add(chain);
    }
  } else if (walk(node) == Walk::whole) {
    if (auto* chain = chain_of(scratch_)) add(*chain);
  }
}

void ChainTracker::note_edge(const ChainNode& node) {
  if (node.writer_gid == 0 || node.source_timestamp == 0) return;  // it took no message
  if (node.is_cut()) return;
  std::optional<CallbackIndex> from;
  if (node.link == ChainNode::Link::resolved && node.parent) from = node.parent->callback;
  // Most often a message comes from where the one before it came from.
  auto& [edge, reader] = lately_[node.callback].edge;
  if (edge == nullptr || edge->from != from) {
    edge = &edges_[{node.callback, from}];
    edge->from = from;
    edge->to = node.callback;
    reader = &model_.callbacks[at(node.callback)];
  }
  ++edge->messages;
  if (node.link == ChainNode::Link::source || node.link == ChainNode::Link::before)
    ++edge->unrecorded;
  if (!node.sent) return;
  if (from && !reader->is_accounted) {
    edge->handover.add(node.start.time - *node.sent);
  }
  if (!node.release) return;
  if (node.writer_host == node.host) {
    if (from) edge->communication.add(*node.release - *node.sent);
    return;
  }
  edge->crosses = HostPair{node.writer_host, node.host};
  OptionalTime written;
  if (node.source_timestamp > 0) written = clocks_.local(node.host, node.source_timestamp);
  // That of a request in ROS 2 is no more than a time that it was not written before.
  const bool is_request = reader->kind == CallbackKind::service && !reader->is_accounted;
  if (from)
    edge->communication.add(*node.release - (written && !is_request ? *written : *node.sent));
  // A publication may be told after its message has arrived: only what came before relates clocks.
  if (written) clocks_.note_message(node.writer_host, node.host, *node.release - *written);
}

ChainTracker::Walk ChainTracker::walk(ChainNode& node, Chain& chain) {
  const auto& hops = chain.facts.hops;
  auto& nodes = scratch_;
  nodes.resize(hops.size());
  auto* current = &node;
  for (std::size_t i = hops.size(); i-- > 0;) {
    const auto& callback = model_.callbacks[at(current->callback)];
    if (callback.logical_id != hops[i]) {
      if (!callback.registered) note_unlinked(chain, *current, i);
      return Walk::other;
    }
    nodes[i] = current;
    if (i == 0) break;
    resolve_again(*current);
    if (current->is_cut()) {
      nodes.erase(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(i));
      std::reverse(nodes.begin(), nodes.end());
      return Walk::missing;
    }
    if (!current->parent) {
      if (current->link == ChainNode::Link::source) note_unlinked(chain, *current, i);
      return Walk::other;
    }
    current = current->parent.get();
  }
  return nodes.front()->is_in_window ? Walk::whole : Walk::other;
}

// Likewise of whatever callbacks have the ids of a chain.
void ChainTracker::interrupt(Chain& chain, const Nodes& known) {
  if (ends_with(chain.hops, known)) chain.progress.has_last = false;
  for (auto& [callbacks, progress] : chain.others)
    if (ends_with(callbacks, known)) progress.has_last = false;
}

void ChainTracker::on_specified(ChainNode& node, const EventRef& end, Chain& chain) {
  switch (walk(node, chain)) {
    case Walk::other:
    case Walk::too_long:
      break;
    case Walk::missing:
      interrupt(chain, scratch_);
      ++chain.facts.incomplete;
      if (!chain.facts.first_incomplete) chain.facts.first_incomplete = scratch_.back()->start;
      break;
    case Walk::whole:
      measure(chain, scratch_, end);
      break;
  }
}

ChainTracker::Walk ChainTracker::walk(ChainNode& node) {
  auto& nodes = scratch_;
  nodes.clear();
  for (auto* current = &node; current != nullptr; current = current->parent.get()) {
    const bool is_too_long =
        nodes.size() == most_hops_ || current->link == ChainNode::Link::forgotten;
    if (is_too_long) return Walk::too_long;
    nodes.push_back(current);
    resolve_again(*current);
    // Where the path begins is unknown.
    if (current->is_cut()) return Walk::missing;
  }
  std::reverse(nodes.begin(), nodes.end());
  return nodes.size() >= 2 && nodes.front()->is_in_window ? Walk::whole : Walk::other;
}

ChainTracker::Chain* ChainTracker::chain_of(const Nodes& nodes) {
  // Most often an instance ends the same path as the one before it.
  auto& lately = lately_[nodes.back()->callback];
  const auto is_that = [&nodes](const Path& path) {
    return std::ranges::equal(nodes, path, {}, &ChainNode::callback);
  };
  if (lately.path != nullptr && is_that(lately.path->first)) return &lately.path->second;
  if (is_that(lately.not_kept)) return nullptr;
  Path path;
  path.reserve(nodes.size());
  for (const auto* node : nodes)
    path.push_back(node->callback);
  if (!paths_.contains(path) && paths_.size() >= kMaxPaths) {
    lately.not_kept = std::move(path);
    return nullptr;
  }
  const auto [found, is_new] = paths_.try_emplace(std::move(path));
  lately.path = &*found;
  if (is_new) ended_by_[nodes.back()->callback].push_back(lately.path);
  return &lately.path->second;
}

bool ChainTracker::has_hole(const Nodes& nodes, const Progress& progress) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto& node = *nodes[i];
    const auto& last = progress.hops[i];
    if (registry_.starts(node.callback).has_hole_between(last.seq, node.seq)) return true;
    // Only numbers that their recorder gave show what was lost.
    if (model_.callbacks[at(node.callback)].is_accounted) continue;
    if (losses_.any_between(node.host, last.start, node.start.time)) return true;
  }
  // What the last callback writes is there at its end: an instance in between whose end is lost wrote, too.
  // Of a reentrant group it may merely go on.
  const auto& last = *nodes.back();
  return registry_.ends(last.callback).has_hole_between(progress.hops.back().seq, last.seq) &&
         registry_.group_type_of(model_.callbacks[at(last.callback)]) != GroupType::reentrant;
}

std::optional<Duration> ChainTracker::to_last(const Nodes& nodes) {
  Duration shift{};
  for (const auto* node : std::span(nodes).subspan(1)) {
    if (!node->sent) return std::nullopt;
    shift += *node->sent - node->published;
  }
  return shift;
}

// What is known of the way: where a release is not, the time from one publish to the next (or to
// the end) stays undivided.
void ChainTracker::note_latency(Chain& chain, const Nodes& nodes, const EventRef& end,
                                Duration to_last) {
  auto& facts = chain.facts;
  const auto latency = end.time - (*nodes.front()->release + to_last);
  auto undivided = latency;
  bool is_divided = true;
  const auto add = [&undivided](Statistics& quantity, Duration part) {
    quantity.add(part);
    undivided = undivided - part;
  };
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto& node = *nodes[i];
    if (!node.release) {
      is_divided = false;
      continue;
    }
    if (i > 0) add(facts.communication[i - 1], *node.release - *node.sent);
    const auto leaves = i + 1 < nodes.size() ? nodes[i + 1]->published : end.time;
    add(facts.processing[i], leaves - *node.release);
  }
  if (!is_divided) facts.undivided.add(undivided);
  facts.path_latency.add(latency);
  keep_larger(facts.max_path_latency, chain.longest.path_latency, latency, nodes.front()->start,
              end);
}

// Of an instance whose path latency is not known.
void ChainTracker::note_bounds(Chain& chain, const Nodes& nodes, const EventRef& end,
                               const std::optional<Duration>& to_last) {
  auto& facts = chain.facts;
  const auto& first = *nodes.front();
  ++facts.inexact;
  if (to_last) {
    keep_larger(facts.max_path_latency_lower, chain.longest.path_latency_lower,
                end.time - (first.start.time + *to_last), first.start, end);
  }
  if (!to_last || !first.earliest || model_.callbacks[at(first.callback)].grid.is_refuted) {
    ++facts.without_upper_bound;
    return;
  }
  keep_larger(facts.max_path_latency_upper, chain.longest.path_latency_upper,
              end.time - (*first.earliest + *to_last), first.start, end);
  facts.bounded_from.insert(first.callback);
}

void ChainTracker::note_by_starts(Chain& chain, const Nodes& nodes, const EventRef& end,
                                  Duration to_last) {
  auto& facts = chain.facts;
  facts.running.resize(nodes.size());
  facts.handover.resize(nodes.size() - 1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto& node = *nodes[i];
    if (i > 0) facts.handover[i - 1].add(node.start.time - *node.sent);
    const auto leaves = i + 1 < nodes.size() ? nodes[i + 1]->published : end.time;
    facts.running[i].add(leaves - node.start.time);
  }
  const auto& first = *nodes.front();
  facts.from_start.add(end.time - (first.start.time + to_last));
  if (!first.earliest) return;
  facts.path_latency_upper.add(end.time - (*first.earliest + to_last));
  facts.bounded_from.insert(first.callback);
}

void ChainTracker::forget_releases(CallbackIndex callback) {
  const auto forget = [callback](Chain& chain) {
    if (!chain.facts.bounded_from.contains(callback)) return;
    chain.facts.path_latency_upper = {};
    chain.facts.max_path_latency_upper.reset();
    chain.longest.path_latency_upper = {};
    chain.facts.without_upper_bound = chain.facts.inexact;
  };
  std::ranges::for_each(specified_, forget);
  for (auto& [path, chain] : paths_)
    forget(chain);
}

void ChainTracker::change_callbacks(Chain& chain, const Nodes& nodes) {
  constexpr std::size_t kMost = 1024;
  if (chain.others.size() >= kMost) chain.others.clear();
  if (!chain.hops.empty()) chain.others[chain.hops] = std::move(chain.progress);
  chain.hops.resize(nodes.size());
  std::transform(nodes.begin(), nodes.end(), chain.hops.begin(),
                 [](const ChainNode* node) { return node->callback; });
  chain.first = &model_.callbacks[at(chain.hops.front())];
  const auto before = chain.others.extract(chain.hops);
  chain.progress = before ? std::move(before.mapped()) : Progress{};
}

void ChainTracker::measure(Chain& chain, const Nodes& nodes, const EventRef& end) {
  auto& facts = chain.facts;
  ++facts.instances;
  const bool is_restarted =
      !std::equal(chain.hops.begin(), chain.hops.end(), nodes.begin(), nodes.end(),
                  [](CallbackIndex hop, const ChainNode* node) { return hop == node->callback; });
  if (is_restarted) change_callbacks(chain, nodes);
  facts.processing.resize(nodes.size());
  facts.communication.resize(nodes.size() - 1);
  if (is_restarted) facts.routes.insert(route_of(nodes));
  const auto& first = *nodes.front();
  const auto shift = to_last(nodes);
  if (first.release && shift) {
    note_latency(chain, nodes, end, *shift);
  } else {
    note_bounds(chain, nodes, end, shift);
  }
  const bool is_of_ros2 = !chain.first->is_accounted;
  if (is_of_ros2 && shift) note_by_starts(chain, nodes, end, *shift);

  auto& progress = chain.progress;
  if (!shift) {
    if (facts.unrelated++ == 0) facts.first_unrelated = end;
    progress.has_last = false;
    note_unproven(chain, nodes, end);
    return;
  }
  if (progress.has_last && !has_hole(nodes, progress)) {
    const auto age = end.time - (progress.last_start.time + *shift);
    facts.data_age.add(age);
    keep_larger(facts.max_data_age, chain.longest.data_age, age, progress.last_start, end);
    answer(chain, first, end, *shift);
  } else {
    progress.newest_start = first.start;
    progress.unanswered = first.read;
  }
  progress.hops.resize(nodes.size());
  std::transform(nodes.begin(), nodes.end(), progress.hops.begin(), [](const ChainNode* node) {
    return Progress::Hop{.seq = node->seq, .start = node->start.time};
  });
  progress.last_start = first.start;
  progress.has_last = true;
  note_unproven(chain, nodes, end);
}

void ChainTracker::answer(Chain& chain, const ChainNode& first, const EventRef& end,
                          Duration to_last) {
  auto& facts = chain.facts;
  auto& progress = chain.progress;
  if (first.start.time <= progress.newest_start.time) return;
  const auto reaction_to = [&](Timestamp read) { return end.time - (read + to_last); };
  const auto& reads = reads_[first.callback];
  const auto oldest = std::min(reads.oldest(), first.read);
  // The read that has waited longest is that of a chain instance, which is known in any case.
  const auto longest = reaction_to(progress.newest_start.time);
  keep_larger(facts.max_reaction_time, chain.longest.reaction_time, longest, progress.newest_start,
              end);
  if (progress.unanswered < oldest) {
    facts.reaction_time.add(longest);
    facts.reads_not_kept += oldest - progress.unanswered - 1;
    progress.unanswered = oldest;
  }
  for (auto& read = progress.unanswered; read < first.read && reads[read] < first.start.time;
       ++read) {
    facts.reaction_time.add(reaction_to(reads[read]));
  }
  progress.newest_start = first.start;
}

}  // namespace cie::analysis
