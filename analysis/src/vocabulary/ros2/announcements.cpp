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

std::optional<GroupId> announce_group(const Callback& callback, const EventHead& head,
                                      Process& process, const EventSink& sink) {
  if (!callback.group) return std::nullopt;
  const auto group = process.directory.group(*callback.group);
  if (!group || !process.announced_groups.insert(*callback.group).second) return group;
  emit(head,
       GroupInit{.group = *group,
                 .node = callback.node.value_or(kNoNode),
                 .type = process.directory.group_type(*callback.group)},
       sink);
  return group;
}

}  // namespace

void announce(CallbackNumber number, const EventHead& head, Process& process,
              const EventSink& sink) {
  auto& callback = process.directory.get(number);
  if (callback.is_told || !callback.kind) return;
  callback.is_told = true;
  announce_node(callback.node, head, process, sink);
  const auto group = announce_group(callback, head, process, sink);
  const auto logical_id = process.directory.logical_id(number);
  emit(head,
       CallbackInit{.callback = callback.id,
                    .group = group.value_or(kNoGroup),
                    .node = callback.node.value_or(kNoNode),
                    .kind = callback.kind,
                    .logical_id = logical_id,
                    .source = callback.source,
                    .symbol = callback.symbol,
                    .period_ns = callback.period_ns,
                    .queue_depth = callback.queue_depth},
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
