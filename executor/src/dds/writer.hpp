// The sending end of a topic.
#pragma once

#include <cie/executor/publisher.hpp>
#include <cie/executor/qos.hpp>
#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dds_entity.hpp"
#include "endpoint_events.hpp"
#include "graph.hpp"
#include "names.hpp"
#include "topic.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace cie::executor {

class ContextState;

// Owns a DDS writer and its topic. Thread-safe.
class Writer {
 public:
  // `node` empty: a writer of ours that is not traced. `user_data` is seen by whoever discovers the
  // writer; `events` may be null. Throws dds::Error, std::logic_error (QoS).
  Writer(std::shared_ptr<ContextState> context, std::optional<NodeId> node, const TopicName& topic,
         const QoS& qos, const dds_topic_descriptor& type, const std::string& user_data = {},
         std::shared_ptr<const EndpointEvents> events = {});
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() = default;

  // Tells ROS 2 that it is this node's.
  void announce(const Graph::Member& node);

  // The event comes first, so that it lies before the arrival in time. False: it was not sent within
  // the QoS's max_blocking_time, which is counted and traced. Throws dds::Error.
  bool publish(const void* message);
  // Readers of this process get the message itself. Also throws std::bad_alloc.
  bool publish(std::shared_ptr<const void> message);
  // What frees shared messages may be code of this library; null: of the program. Before any is
  // published.
  void keep_loaded(std::shared_ptr<void> library) { library_ = std::move(library); }
  // `message` with the library it needs.
  std::shared_ptr<const void> with_library(std::shared_ptr<const void> message) const;

  const std::string& topic() const noexcept { return name_; }
  std::uint64_t gid() const noexcept { return gid_; }
  std::uint64_t unsent() const noexcept { return unsent_; }
  std::uint32_t matched() const;
  void assert_liveliness() const;
  const LayoutPtr& layout() const noexcept { return topic_.layout(); }
  dds_entity_t entity() const noexcept { return writer_.get(); }

 private:
  // Of the message that is published now; with mutex_ held.
  std::int64_t next_timestamp() noexcept { return trace_ ? trace_->publish() : dds_time(); }
  // Whether the message was sent, by what DDS says; with mutex_ held. Throws dds::Error.
  bool is_sent(dds_return_t code, std::int64_t timestamp);

  std::shared_ptr<ContextState> context_;
  std::shared_ptr<void> library_;
  std::shared_ptr<const EndpointEvents> events_;
  std::string name_;
  Topic topic_;
  dds::Entity writer_;
  Graph::Member graph_member_;
  std::uint64_t gid_ = 0;
  PriorityMutex mutex_;  // keeps number, timestamp and message in one order
  std::optional<trace::Publisher> trace_;
  std::atomic<std::uint64_t> unsent_{0};
};

}  // namespace cie::executor
