#include "announcements.hpp"

#include <optional>

namespace cie::analysis::ros2 {
namespace {

void announce_node(std::optional<NodeId> id, const EventHead& head, Process& process,
                   const EventSink& sink) {
  auto* node = id ? process.directory.node(*id) : nullptr;
  if (node == nullptr || node->is_told) return;
  node->is_told = true;
  emit(head, NodeInit{.node = node->id, .name = node->name}, sink);
}

// Of a callback, hidden or not.
std::optional<GroupId> announce_group_of(const auto& member, const EventHead& head,
                                         Process& process, const EventSink& sink) {
  if (!member.group) return std::nullopt;
  const auto group = process.directory.group(*member.group);
  if (!group || !process.announced_groups.insert(*member.group).second) return group;
  emit(head,
       GroupInit{.group = *group,
                 .node = member.node.value_or(kNoNode),
                 .type = process.directory.group_type(*member.group)},
       sink);
  return group;
}

}  // namespace

void announce(Callback& callback, const EventHead& head, Process& process, const EventSink& sink) {
  if (callback.is_told || !callback.kind) return;
  process.directory.find_node(callback);
  if (process.is_repeated && callback.kind == CallbackKind::timer && !callback.node) return;
  callback.is_told = true;
  announce_node(callback.node, head, process, sink);
  const auto group = announce_group_of(callback, head, process, sink);
  const auto logical_id = callback.id_beside_own.empty() ? process.directory.logical_id(callback)
                                                         : callback.id_beside_own;
  const auto* const former = callback.former;
  emit(head,
       CallbackInit{
           .callback = callback.id,
           .group = group.value_or(kNoGroup),
           .node = callback.node.value_or(kNoNode),
           .kind = callback.kind,
           .logical_id = logical_id,
           .source = callback.source,
           .symbol = callback.symbol,
           .period_ns = callback.period_ns.value_or(0),
           .queue_depth = callback.queue_depth,
           .inferred = {.first_expiry = callback.first_expiry,
                        .expiry_spread = callback.expiry_spread,
                        .is_identified = callback.is_identified,
                        .is_after_rcl_init = callback.is_after_rcl_init,
                        .made = callback.made,
                        .shares_address = Directory::shares_address(callback),
                        .former = former != nullptr && former->is_told ? former->id : kNoCallback}},
       sink);
}

void announce_hidden(std::uint32_t number, const EventHead& head, Process& process,
                     const EventSink& sink) {
  const auto& hidden = process.directory.hidden(number);
  const auto group = announce_group_of(hidden, head, process, sink);
  const auto* node = hidden.node ? process.directory.node(*hidden.node) : nullptr;
  emit(head,
       UntracedEntity{.hidden = number,
                      .group = group.value_or(kNoGroup),
                      .is_client = hidden.is_client,
                      .is_action = hidden.is_action,
                      .is_pooled = hidden.group && process.directory.is_pooled(*hidden.group),
                      .what = hidden.what,
                      .node = node != nullptr ? std::string_view(node->name) : std::string_view{}},
       sink);
}

void announce(Publisher& publisher, const EventHead& head, Process& process,
              const EventSink& sink) {
  if (publisher.is_told || publisher.topic.empty()) return;
  publisher.is_told = true;
  announce_node(publisher.node, head, process, sink);
  emit(head,
       PublisherInit{.publisher = publisher.id,
                     .node = publisher.node.value_or(kNoNode),
                     .topic = publisher.topic,
                     .writer_gid = publisher.gid,
                     .next_seq = 0},
       sink);
}

}  // namespace cie::analysis::ros2
