// What a publisher or a subscription can be told besides messages, under the names of ROS 2.
#pragma once

#include <cie/executor/callback_group.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

namespace cie {

enum class QosPolicyKind : std::uint8_t {
  other,
  durability,
  deadline,
  liveliness,
  reliability,
  data_representation
};
// "reliability".
std::string_view label(QosPolicyKind kind) noexcept;

// Counts are since the endpoint was created; a change is since the callback ran last. Changes that
// come while an instance waits or runs are told together, and then an instance may find them told.

// Messages were further apart than the deadline in the QoS: offered by a publisher, asked for by a
// subscription. It is not the deadline of a callback (CallbackOptions).
struct DeadlineMissedInfo {
  std::uint32_t total_count = 0;
  std::int32_t total_count_change = 0;
};
// Publishers that are alive, or said nothing of it for longer than their lease.
struct LivelinessChangedInfo {
  std::uint32_t alive_count = 0;
  std::uint32_t not_alive_count = 0;
  std::int32_t alive_count_change = 0;
  std::int32_t not_alive_count_change = 0;
};
// The publisher itself said nothing for longer than its lease.
struct LivelinessLostInfo {
  std::uint32_t total_count = 0;
  std::int32_t total_count_change = 0;
};
// Endpoints of the topic that are not connected, because less is offered than asked for.
struct IncompatibleQosInfo {
  std::uint32_t total_count = 0;
  std::int32_t total_count_change = 0;
  QosPolicyKind last_policy_kind = QosPolicyKind::other;
};
// Endpoints of the topic that are connected.
struct MatchedInfo {
  std::uint32_t total_count = 0;
  std::int32_t total_count_change = 0;
  std::uint32_t current_count = 0;
  std::int32_t current_count_change = 0;
};
// Messages that never came into the queue: lost on the network, or unreadable.
struct MessageLostInfo {
  std::uint64_t total_count = 0;
  std::uint64_t total_count_change = 0;
};

// Each one given is a callback of its own: of kind waitable, with an id such as
// "/node@RequestedDeadlineMissed(/topic)", released in the thread in which DDS notices. It ends
// with its endpoint. Without incompatible_qos_callback the Context warns of incompatible QoS.
struct SubscriptionEventCallbacks {
  std::function<void(const DeadlineMissedInfo&)> deadline_callback{};
  std::function<void(const LivelinessChangedInfo&)> liveliness_callback{};
  std::function<void(const IncompatibleQosInfo&)> incompatible_qos_callback{};
  std::function<void(const MessageLostInfo&)> message_lost_callback{};
  std::function<void(const MatchedInfo&)> matched_callback{};
  std::shared_ptr<CallbackGroup> group{};  // of all these; null: a group of its own for each
};
struct PublisherEventCallbacks {
  std::function<void(const DeadlineMissedInfo&)> deadline_callback{};
  std::function<void(const LivelinessLostInfo&)> liveliness_callback{};
  std::function<void(const IncompatibleQosInfo&)> incompatible_qos_callback{};
  std::function<void(const MatchedInfo&)> matched_callback{};
  std::shared_ptr<CallbackGroup> group{};
};

struct SubscriptionOptions : CallbackOptions {
  SubscriptionEventCallbacks event_callbacks{};
};
struct PublisherOptions {
  PublisherEventCallbacks event_callbacks{};
};

}  // namespace cie
