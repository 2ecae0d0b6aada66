// Which publication led to an instance, and by whom: what links instances to chains.
#include "base/prefetch.hpp"
#include "chain_tracker.hpp"

#include <algorithm>

namespace cie::analysis {

void ChainTracker::on_publish_unseen(std::uint32_t publisher, std::int64_t source_timestamp) {
  auto& facts = model_.publishers[publisher];
  if (facts.first_source_timestamp == 0 && source_timestamp > 0)
    facts.first_source_timestamp = source_timestamp;
}

void ChainTracker::on_publish(std::uint32_t publisher, const EventRef& where,
                              std::int64_t source_timestamp, ChainNodeRef node) {
  on_publish_unseen(publisher, source_timestamp);
  auto& [messages, host] = publishers_[publisher];
  host = model_.processes[at(model_.publishers[publisher].process)].host;
  messages.push(
      Message{.source_timestamp = source_timestamp, .time = where.time, .node = std::move(node)});
  // It was not looked at for long; to give its node back would be to wait for memory.
  messages.prefetch_oldest([](const Message& oldest) { return oldest.node.get(); });
}

const ChainTracker::Message* ChainTracker::find_message(std::uint32_t publisher,
                                                        std::int64_t source_timestamp) const {
  const auto* known = publishers_.find(publisher);
  if (known == nullptr) return nullptr;
  return known->messages.find_newest([source_timestamp](const Message& message) {
    return message.source_timestamp == source_timestamp;
  });
}

bool ChainTracker::is_published(const ChainNode& node) const {
  const auto publisher = registry_.publisher_by_gid(node.host, node.writer_gid);
  return publisher && find_message(*publisher, node.source_timestamp) != nullptr;
}

bool ChainTracker::is_any_awaited(ChainNode& node) {
  for (auto* current = &node; current != nullptr; current = current->parent.get()) {
    resolve_again(*current);
    if (is_awaited(*current)) return true;
  }
  return false;
}

bool ChainTracker::is_awaited(const ChainNode& node) const {
  if (node.writer_gid == 0 || node.source_timestamp <= 0) return false;
  if (node.link == ChainNode::Link::source) return true;
  const bool is_unread =
      node.link == ChainNode::Link::before || node.link == ChainNode::Link::unseen;
  const auto publisher =
      is_unread ? registry_.publisher_by_gid(node.host, node.writer_gid) : std::nullopt;
  if (!publisher) return false;
  return model_.processes[at(model_.publishers[*publisher].process)].host != node.host;
}

bool ChainTracker::is_any_ahead(ChainNode& node) {
  for (auto* current = &node; current != nullptr; current = current->parent.get()) {
    resolve_again(*current);
    if (is_ahead(*current)) return true;
  }
  return false;
}

bool ChainTracker::is_ahead(const ChainNode& node) const {
  const bool is_unread =
      node.link == ChainNode::Link::before || node.link == ChainNode::Link::unseen;
  if (!is_unread || node.source_timestamp <= 0) return false;
  const auto publisher = registry_.publisher_by_gid(node.host, node.writer_gid);
  if (!publisher) return false;
  const auto* known = publishers_.find(*publisher);
  return known == nullptr || known->messages.size() == 0 ||
         known->messages.newest(0).source_timestamp < node.source_timestamp;
}

std::optional<std::uint32_t> ChainTracker::writer_of(const ChainNode& node) {
  auto& last = lately_[node.callback];
  const auto told = registry_.publishers_told();
  if (last.writer_gid == node.writer_gid && last.publishers_told == told) return last.publisher;
  const auto publisher = registry_.publisher_by_gid(node.host, node.writer_gid);
  if (publisher) {
    last.writer_gid = node.writer_gid;
    last.publisher = *publisher;
    last.publishers_told = told;
  }
  return publisher;
}

// Not by its source timestamp, as long as anything else tells: what passed between the publication and
// that would belong to no part of the path.
std::optional<Timestamp> ChainTracker::sent(HostIndex reader, HostIndex writer, Timestamp published,
                                            std::int64_t source_timestamp) const noexcept {
  if (writer == reader) return published;
  const auto related = clocks_.local(reader, writer, published);
  if (related || source_timestamp <= 0) return related;
  return clocks_.local(reader, source_timestamp);
}

void ChainTracker::resolve(ChainNode& node) {
  if (node.writer_gid == 0 || node.source_timestamp == 0) return;
  if (node.link == ChainNode::Link::resolved || node.link == ChainNode::Link::outside ||
      node.link == ChainNode::Link::forgotten) {
    return;
  }
  const auto publisher = writer_of(node);
  if (!publisher) {
    node.link = ChainNode::Link::source;  // written by somebody who is not traced
    return;
  }
  const auto* found = find_message(*publisher, node.source_timestamp);
  if (found == nullptr) {
    if (node.source_timestamp < 0) {  // a name, which has no place in time
      node.link = ChainNode::Link::unseen;
      return;
    }
    const auto first = model_.publishers[*publisher].first_source_timestamp;
    node.link = first == 0 || node.source_timestamp < first ? ChainNode::Link::before
                                                            : ChainNode::Link::unseen;
    is_any_ahead_ = is_any_ahead_ || is_ahead(node);
    return;
  }
  node.published = found->time;
  node.writer_host = publishers_.find(*publisher)->host;
  node.sent = sent(node.host, node.writer_host, found->time, node.source_timestamp);
  if (!found->node) {
    node.link = ChainNode::Link::outside;
    return;
  }
  node.link = ChainNode::Link::resolved;
  auto& parent = *found->node;
  if (parent.parent) parent.depth = std::max(parent.depth, parent.parent->depth + 1);
  // A loop of callbacks: who takes this message, too, needs no more of it.
  if (parent.depth >= 2 * most_hops_) found->node = nodes_.copy_of_last(parent, most_hops_);
  node.parent = found->node;
  node.depth = node.parent->depth + 1;
}

void ChainTracker::prefetch_start(CallbackIndex callback) const noexcept {
  const auto* last = lately_.find(callback);
  if (last == nullptr) return;
  prefetch_to_write(last->edge.facts);
  if (last->path == nullptr) return;
  prefetch_head(last->path);
  const auto& chain = last->path->second;
  prefetch_lines(&chain.facts.instances, &chain.facts.name);
  prefetch_lines(&chain.longest, &chain.others);
}

void ChainTracker::link(ChainNode& node) {
  resolve(node);
  // What it will be measured by when it ends.
  const auto* last = lately_.find(node.callback);
  if (last == nullptr) return;
  prefetch_to_write(last->edge.facts);
  if (last->path == nullptr) return;
  const auto& facts = last->path->second.facts;
  prefetch_head(&facts.instances);
  prefetch_place(facts.path_latency.next_place());
  prefetch_place(facts.reaction_time.next_place());
  prefetch_place(facts.data_age.next_place());
  prefetch_to_write(&last->path->second.progress);
  for (const auto& quantity : facts.processing)
    prefetch_place(quantity.next_place());
  for (const auto& quantity : facts.communication)
    prefetch_place(quantity.next_place());
}

}  // namespace cie::analysis
