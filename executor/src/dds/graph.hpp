// This process's part of the ROS 2 graph.
#pragma once

#include <cie/executor/context.hpp>

#include "dds_entity.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace cie::executor {

// Publishes which nodes the process has, and which endpoints each of them has, again whenever that
// changes, as rmw_dds_common does. Thread-safe.
class Graph {
 public:
  enum class Direction : std::uint8_t { reader, writer };

  // A node or an endpoint that is announced as long as this lives. Outlived by its graph.
  class Member {
   public:
    Member() = default;
    Member(Member&& other) noexcept
        : graph_(std::exchange(other.graph_, nullptr)),
          node_(other.node_),
          endpoint_(other.endpoint_) {}
    Member& operator=(Member&& other) noexcept {
      std::swap(graph_, other.graph_);
      std::swap(node_, other.node_);
      std::swap(endpoint_, other.endpoint_);
      return *this;
    }
    ~Member() {
      if (graph_ != nullptr) graph_->remove(node_, endpoint_);
    }

   private:
    friend class Graph;
    Member(Graph& graph, std::uint64_t node, std::uint64_t endpoint) noexcept
        : graph_(&graph), node_(node), endpoint_(endpoint) {}
    Graph* graph_ = nullptr;
    std::uint64_t node_ = 0;
    std::uint64_t endpoint_ = 0;  // 0: the node itself
  };

  // Throws dds::Error.
  Graph(dds_entity_t participant, RosGraph form);

  // `qualified_name` is "/ns/name". Throws dds::Error.
  Member add_node(std::string_view qualified_name);
  // An endpoint of that node; without effect when the node is gone. Throws dds::Error.
  Member add_endpoint(const Member& node, Direction direction, dds_entity_t entity);

 private:
  using Guid = std::array<std::uint8_t, 16>;
  struct Node {
    std::string name_space;
    std::string name;
    std::map<std::uint64_t, Guid> readers;  // in the order of their making
    std::map<std::uint64_t, Guid> writers;
  };

  void remove(std::uint64_t node, std::uint64_t endpoint) noexcept;
  // With mutex_ held, so that what is published last is true.
  void publish() const;
  template <typename Info>
  void publish_as() const;

  RosGraph form_;
  Guid participant_{};
  dds::Entity topic_;
  dds::Entity writer_;
  std::mutex mutex_;
  std::uint64_t last_id_ = 0;
  std::map<std::uint64_t, Node> nodes_;
};

}  // namespace cie::executor
