// The callbacks of what DDS notices of an endpoint.
#pragma once

#include <cie/executor/event_callbacks.hpp>
#include <cie/scheduling/callback.hpp>

#include "dds/endpoint_events.hpp"
#include "scheduling_names.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <vector>

namespace cie::executor {

class NodeState;

struct EndpointCallbacks {
  std::vector<std::shared_ptr<Callback>> callbacks{};
  // For the endpoint, which keeps it: releases them.
  std::shared_ptr<const EndpointEvents> events{};
  // The endpoint; to be set before the callbacks are served.
  std::shared_ptr<std::atomic<dds_entity_t>> entity{};
};

// `name` stands in their ids' parentheses; empty: the topic. Throws std::logic_error if the given
// group belongs to another node.
EndpointCallbacks endpoint_callbacks(NodeState& node, const std::string& topic,
                                     const std::string& name,
                                     const SubscriptionEventCallbacks& given);
EndpointCallbacks endpoint_callbacks(NodeState& node, const std::string& topic,
                                     const PublisherEventCallbacks& given);

}  // namespace cie::executor
