#include "graph.hpp"

#include <cie/executor/message.hpp>

#include "dds_qos.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <rmw_dds_common.h>
#include <rmw_dds_common_iron.h>

namespace cie::executor {
namespace {

constexpr const char* kTopic = "ros_discovery_info";
constexpr const char* kTypeName = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

using HumbleInfo = rmw_dds_common_msg_ParticipantEntitiesInfo;
using IronInfo = rmw_dds_common_iron_msg_ParticipantEntitiesInfo;

std::array<std::uint8_t, 16> guid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  dds::check(dds_get_guid(entity, &guid), "asking for the GUID", kTopic);
  std::array<std::uint8_t, 16> bytes{};
  std::ranges::copy(guid.v, bytes.begin());
  return bytes;
}

template <typename Gid>
Gid to_gid(const std::array<std::uint8_t, 16>& guid) {
  Gid gid{};  // what is longer than a GUID ends in zeros
  std::ranges::copy(guid, gid.data);
  return gid;
}

template <std::size_t Size>
void copy_text(const std::string& text, char (&field)[Size]) {
  std::copy_n(text.begin(), std::min(text.size(), Size - 1), field);
}

// Has a message's sequence refer to elements that somebody else owns.
template <typename Sequence, typename Element>
void refer_to(Sequence& sequence, std::vector<Element>& elements) {
  sequence._buffer = elements.data();
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(elements.size());
}

}  // namespace

Graph::Graph(dds_entity_t participant, RosGraph form)
    : form_(form), participant_(guid_of(participant)) {
  if (form_ == RosGraph::none) return;
  const dds_topic_descriptor type = with_wire_name(
      form_ == RosGraph::humble ? rmw_dds_common_msg_ParticipantEntitiesInfo_desc
                                : rmw_dds_common_iron_msg_ParticipantEntitiesInfo_desc,
      kTypeName);
  const auto qos = dds::to_dds(QoS{KeepLast{1}}.transient_local(), kTopic);
  topic_ = dds::Entity{dds_create_topic(participant, &type, kTopic, nullptr, nullptr),
                       "creating the DDS topic", kTopic};
  writer_ = dds::Entity{dds_create_writer(participant, topic_.get(), qos.get(), nullptr),
                        "creating the DDS writer", kTopic};
}

Graph::Member Graph::add_node(std::string_view qualified_name) {
  const std::lock_guard lock{mutex_};
  const std::uint64_t id = ++last_id_;
  const auto slash = qualified_name.rfind('/');
  nodes_[id] = {
      .name_space = std::string{qualified_name.substr(0, std::max<std::size_t>(slash, 1))},
      .name = std::string{qualified_name.substr(slash + 1)},
      .readers = {},
      .writers = {}};
  Member member{*this, id, 0};
  publish();
  return member;
}

Graph::Member Graph::add_endpoint(const Member& node, Direction direction, dds_entity_t entity) {
  const Guid guid = guid_of(entity);
  const std::lock_guard lock{mutex_};
  const auto found = nodes_.find(node.node_);
  if (found == nodes_.end()) return {};
  const std::uint64_t id = ++last_id_;
  auto& endpoints = direction == Direction::reader ? found->second.readers : found->second.writers;
  endpoints.emplace(id, guid);
  publish();
  return {*this, node.node_, id};
}

void Graph::remove(std::uint64_t node, std::uint64_t endpoint) noexcept {
  const std::lock_guard lock{mutex_};
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  if (endpoint == 0) {
    nodes_.erase(found);
  } else {
    found->second.readers.erase(endpoint);
    found->second.writers.erase(endpoint);
  }
  try {
    publish();
  } catch (const std::exception&) {
    // The next change tells; if there is none, the participant goes, and with it all it said.
  }
}

void Graph::publish() const {
  if (form_ == RosGraph::humble) publish_as<HumbleInfo>();
  if (form_ == RosGraph::iron) publish_as<IronInfo>();
}

template <typename Info>
void Graph::publish_as() const {
  using Gid = decltype(Info::gid);
  using NodeInfo = std::remove_pointer_t<decltype(Info::node_entities_info_seq._buffer)>;
  const auto gids_of = [](const std::map<std::uint64_t, Guid>& endpoints) {
    std::vector<Gid> gids;
    gids.reserve(endpoints.size());
    for (const auto& [id, guid] : endpoints)
      gids.push_back(to_gid<Gid>(guid));
    return gids;
  };
  std::vector<NodeInfo> nodes;
  std::vector<std::vector<Gid>> gids;  // of all nodes; the messages below refer to them
  for (const auto& [id, node] : nodes_) {
    NodeInfo info{};
    copy_text(node.name_space, info.node_namespace);
    copy_text(node.name, info.node_name);
    refer_to(info.reader_gid_seq, gids.emplace_back(gids_of(node.readers)));
    refer_to(info.writer_gid_seq, gids.emplace_back(gids_of(node.writers)));
    nodes.push_back(info);
  }
  Info info{};
  info.gid = to_gid<Gid>(participant_);
  refer_to(info.node_entities_info_seq, nodes);
  dds::check(dds_write(writer_.get(), &info), "publishing the nodes", kTopic);
}

}  // namespace cie::executor
