// The receiving end of a topic.
#pragma once

#include <cie/executor/message.hpp>
#include <cie/executor/qos.hpp>

#include "dds_entity.hpp"
#include "delivery.hpp"
#include "endpoint_events.hpp"
#include "graph.hpp"
#include "message_pool.hpp"
#include "names.hpp"
#include "topic.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace cie::executor {

class ContextState;

// Owns a DDS reader and its topic. take() and matched() from any thread.
class Reader {
 public:
  // What the reader of a service's replies needs more than others.
  struct Reply {
    std::uint64_t recipient = 0;  // the `guid` of the headers that are meant; others never enter
  };
  // `user_data` is seen by whoever discovers the reader; `events` may be null. Throws dds::Error, std::logic_error (QoS).
  Reader(std::shared_ptr<ContextState> context, const TopicName& topic, const QoS& qos,
         const dds_topic_descriptor& type, const std::string& user_data = {},
         std::optional<Reply> reply = {}, std::shared_ptr<const EndpointEvents> events = {});
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  // Deletes the reader first, which waits for its listener: not in a callback of DDS.
  ~Reader() = default;

  // Tells ROS 2 that it is this node's.
  void announce(const Graph::Member& node);

  // Takes the next message: by reference to the publisher's if it came by pointer, else into the
  // loaned memory, whose contents' memory is reused. Says what is known of it. One that no message
  // can hold is lost, and the next one is taken. False when there is none. Throws std::bad_alloc.
  bool take(MessagePool::Loan& message, MessageInfo& info);

  // Ends the queue: what comes is dropped, what is in it is discarded. Returns how many samples
  // were overwritten in all, exactly.
  std::uint64_t close();

  // Triggered while samples wait. Must go before the reader does. Throws dds::Error.
  dds::Entity new_read_condition() const;

  const LayoutPtr& layout() const noexcept { return topic_.layout(); }

  // How many samples wait, about.
  std::uint64_t queued() const noexcept { return delivery_->count().queued(); }

  Delivery& delivery() noexcept { return *delivery_; }
  std::uint32_t matched() const;
  dds_entity_t entity() const noexcept { return reader_.get(); }

 private:
  std::shared_ptr<ContextState> context_;
  std::shared_ptr<const EndpointEvents> events_;
  std::shared_ptr<Delivery> delivery_;
  Topic topic_;
  // Cyclone serialises the samples, and there may be texts in them that no message can hold.
  bool is_searched_;
  dds::Entity reader_;
  Graph::Member graph_member_;
};

}  // namespace cie::executor
